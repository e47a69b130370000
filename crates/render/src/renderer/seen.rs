//! What of a scene a view shows: what is in the picture and before the walls, prepared when it is first seen.

use std::sync::Arc;

use glam::{DMat4, DVec3};

use super::Renderer;
use crate::covers::Candidate;
use crate::culling::{Culling, Stand};
use crate::frame_binding::light_infos;
use crate::geometry::Room;
use crate::prepare::{InScene, address};
use crate::shell::SceneSolids;
use crate::sorting::Sorting;
use crate::uniforms::DrawInfo;
use crate::view::{Call, ViewOf};
use crate::{Camera, Draw, RenderError, Skips, Stats, TechniqueChoice, tally};

impl Renderer<'_> {
    pub(super) fn culling(&self, camera: &Camera) -> Culling {
        Culling::new(camera, [self.request.width, self.request.height], self.request.skips)
    }

    /// How a draw stands in a view, unless it is outside.
    pub(super) fn stands(&self, at: usize, camera: &Camera, culling: &Culling) -> Option<Stand> {
        let draw = &self.scene.draws[at];
        let &Room { middle, radius, .. } = self.rooms.get(&address(&draw.mesh))?;
        let relative =
            DMat4::from_translation(-camera.eye) * draw.world_from_object * DMat4::from_translation(middle);
        // What stays on the mesh covers the mesh, whatever depth it shows.
        let reach =
            if self.request.reads_solids() { f64::from(draw.material.field.extent().scale) } else { 0.0 };
        let stand = Stand::new(relative, radius + reach, draw.material.double_sided);
        let seen = !draw.triangles.is_empty() && !culling.misses(relative.w_axis.truncate(), stand.radius);
        seen.then_some(stand)
    }

    /// Tells which walls of the scene hide what is behind them: those that are drawn as they are.
    fn find_walls(&self, camera: &Camera, culling: &mut Culling) {
        if self.request.in_shell() || self.request.technique.draws_geometry() {
            return;
        }
        for (at, draw) in self.scene.draws.iter().enumerate() {
            let Some(Room { middle, walls, .. }) = self.rooms.get(&address(&draw.mesh)) else { continue };
            if walls.is_empty() {
                continue;
            }
            let Some(stand) = self.stands(at, camera, culling) else { continue };
            let extent = draw.material.field.extent();
            let depth = if self.request.technique.displaces() { extent.scale * extent.base } else { 0.0 };
            for wall in
                walls.iter().filter(|wall| wall.faces.iter().all(|face| draw.triangles.contains(face)))
            {
                culling.add_wall(wall, &stand, *middle, f64::from(depth));
            }
        }
        culling.settle_walls();
    }

    /// Tells what meshes of the scene cover what is behind them.
    fn find_covers(&self, camera: &Camera, culling: &mut Culling) {
        let displaced = self.request.in_shell() || self.request.technique.draws_geometry();
        if displaced || !self.request.skips.contains(Skips::OCCLUSION) || self.scene.draws.len() < 2 {
            return;
        }
        let draws = self.scene.draws.iter().enumerate();
        let candidates: Vec<_> = draws
            .filter_map(|(at, draw)| {
                let stand = self.stands(at, camera, culling)?;
                let outline = culling.outline(stand.relative_from_object.w_axis.truncate(), stand.radius)?;
                let Draw { mesh, material, triangles, .. } = draw;
                let extent = material.field.extent();
                let depth = if self.request.technique.displaces() { extent.scale * extent.base } else { 0.0 };
                let middle = self.rooms.get(&address(mesh)).map_or(DVec3::ZERO, |room| room.middle);
                let triangles = triangles.clone();
                Some(Candidate { mesh, triangles, middle, stand, outline, depth: f64::from(depth) })
            })
            .collect();
        culling.add_covers(&candidates);
    }

    /// Builds the solids of the scene where programs read them and places them for a view: all of them, since
    /// what is outside the picture may throw a shadow into it. Gives for each draw what
    /// [`DrawInfo::own`] holds.
    fn place_solids(&mut self, camera: &Camera) -> Result<Vec<[u32; 2]>, RenderError> {
        if !self.request.reads_solids() {
            return Ok(Vec::new());
        }
        let middle = |draw: &Draw<'_>| self.rooms.get(&address(&draw.mesh)).map(|room| room.middle);
        let middles: Vec<_> = self.scene.draws.iter().map(|draw| middle(draw).unwrap_or_default()).collect();
        let solids = match self.solids.take() {
            Some(solids) => solids,
            None => {
                let traced = self.request.traces_solids();
                SceneSolids::new(&self.device, &self.scene, &middles, &self.shared.places, traced)?
            }
        };
        let away = DMat4::from_translation(-camera.eye);
        let relative = |(draw, middle): (&Draw<'_>, &DVec3)| {
            away * draw.world_from_object * DMat4::from_translation(*middle)
        };
        let relative: Vec<DMat4> = self.scene.draws.iter().zip(&middles).map(relative).collect();
        let numbers = solids.place(&self.device, &relative)?;
        let own = |(at, number)| [number, solids.of_draw(at)];
        let own = numbers.into_iter().enumerate().map(own).collect();
        self.solids = Some(solids);
        Ok(own)
    }

    /// How the draws are sorted; nothing where techniques do not march.
    fn sorted(&mut self) -> Arc<Sorting> {
        let marches =
            matches!(self.request.technique, TechniqueChoice::Search(_)) && !self.request.in_shell();
        let make = || {
            let sorts = self.request.skips.contains(Skips::DEPTH_FIRST);
            if marches { Sorting::of(&self.scene.draws, &self.rooms, sorts) } else { Sorting::default() }
        };
        Arc::clone(self.sorting.get_or_insert_with(|| Arc::new(make())))
    }

    /// What is drawn of a view, with its places and lights on the device.
    pub(super) fn view(
        &mut self,
        camera: &Camera,
        stats: &mut Stats,
        warnings: &mut Vec<String>,
    ) -> Result<Vec<Call>, RenderError> {
        let mut culling = self.culling(camera);
        self.find_walls(camera, &mut culling);
        self.find_covers(camera, &mut culling);
        let numbers = self.place_solids(camera)?;
        let sorting = self.sorted();
        let [light, ..] = light_infos(&self.scene, camera.eye)[..] else { return Ok(Vec::new()) };
        let mut view = ViewOf::new(&self.device, camera, &self.request, &culling);
        let stride = self.shared.stride as usize;
        let mut places = Vec::new();
        for at in 0..self.draws.len() {
            let draw = &self.scene.draws[at];
            let Some(stand) = self.stands(at, camera, &culling) else {
                let count = u64::from(draw.triangles.end - draw.triangles.start);
                stats.skipped.add(Skips::FRUSTUM, count);
                continue;
            };
            let ball = stand.relative_from_object.w_axis.truncate();
            if self.request.is_solid(&draw.material) && culling.is_hidden(ball, stand.radius) {
                let count = u64::from(draw.triangles.end - draw.triangles.start);
                stats.skipped.add(Skips::OCCLUSION, count);
                continue;
            }
            let middle = self.rooms.get(&address(&draw.mesh)).map_or(DVec3::ZERO, |room| room.middle);
            if self.draws[at].is_none() {
                let solids = self.solids.as_ref().map(|solids| (solids, solids.of_draw(at)));
                let apart = sorting.apart.get(at).copied().unwrap_or_default();
                let known = InScene { middle, apart, solids };
                let made = self.shared.prepare(&self.device, draw, known, &self.request, stats)?;
                self.draws[at] = Some(made);
            }
            let Some(prepared) = &self.draws[at] else { continue };
            let own = numbers.get(at).copied().unwrap_or_default();
            let leeway = prepared.sparing.leeway(camera, &self.request, &stand);
            let offset = places.len() as u32;
            if view.add(at, draw, middle, prepared, &stand, &leeway, offset, stats, warnings)? {
                let shown = sorting.shown.get(at).copied().unwrap_or_default();
                let place = DrawInfo::of(stand.relative_from_object, shown, &light, own);
                let place = prepared.sparing.told(place, &leeway, &self.request);
                places.extend_from_slice(bytemuck::bytes_of(&place));
                places.resize(places.len().next_multiple_of(stride), 0);
            }
        }
        stats.triangles_culled = stats.skipped.culled();
        tally::uploaded(places.len() as u64);
        self.device.guard("placing draws", || {
            self.device.queue.write_buffer(&self.shared.places, 0, &places);
            self.frame.write_lights(&self.device, &self.scene, camera.eye);
            Ok(())
        })?;
        Ok(view.calls(stats))
    }
}
