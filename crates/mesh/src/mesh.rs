//! The mesh every other crate works on.

use std::ops::Range;
use std::path::Path;

use glam::{Vec2, Vec3, Vec4};

use crate::arrays::{Arrays, checked};
use crate::error::MeshError;
use crate::frame::{FrameMethod, Split, Surface, derivatives, normal_derivatives};
use crate::material::MaterialSource;

/// A run of triangles with one name and one material.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Object, group or node name; may be empty.
    pub name: String,
    /// Rows of [`Mesh::indices`].
    pub triangles: Range<u32>,
    /// Index into [`Mesh::materials`].
    pub material: Option<usize>,
}

/// An indexed triangle mesh with a tangent frame and UV derivatives at every vertex.
///
/// All per-vertex vectors have the same length and every index is below it. All numbers are
/// finite, normals and tangents have unit length. The parts cover the triangles in order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Positions, mesh units.
    pub positions: Vec<Vec3>,
    /// Unit normals.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, origin top left, `v` down.
    pub uvs: Vec<Vec2>,
    /// Triangles, counter-clockwise seen from outside.
    pub indices: Vec<[u32; 3]>,
    /// Ascending: triangles `abc` that the next one, `acd`, makes a quad of the file. MikkTSpace sees
    /// such quads whole; everything else sees triangles.
    pub quads: Vec<u32>,
    /// Tangents as in glTF: `xyz` unit, `w` = +1 or -1; `w (N x T)` points *up* the image.
    pub tangents: Vec<Vec4>,
    /// `dP/du`, mesh units per UV unit, not normalised.
    pub dpdu: Vec<Vec3>,
    /// `dP/dv` with `v` down, mesh units per UV unit, not normalised.
    pub dpdv: Vec<Vec3>,
    /// Runs of triangles.
    pub parts: Vec<Part>,
    /// Materials of the parts.
    pub materials: Vec<MaterialSource>,
    /// What was repaired, replaced or left out while the mesh was made.
    pub warnings: Vec<String>,
}

impl Mesh {
    /// Reads an OBJ, glTF or GLB file. The suffix decides; failing that, the first bytes do.
    ///
    /// glTF: the default scene only (the first one when none is marked, all root nodes when there
    /// is no scene, all meshes when there are no nodes either), node transforms applied, each primitive a part. A node transform that mirrors
    /// reverses the winding and the tangent's `w`, so that triangles stay counter-clockwise and
    /// normal maps keep their up. Given tangents are kept; otherwise MikkTSpace is run on each
    /// primitive in its own space. Missing normals are flat, as glTF asks.
    ///
    /// OBJ: objects, groups and materials become parts. Missing normals are smoothed over edges
    /// that bend by less than 60 degrees and stay hard elsewhere. MikkTSpace is run on the file's
    /// triangles and quads, as in Blender, and on the triangles of larger polygons and of quads
    /// whose triangles are given different normals where they meet. Missing material libraries and textures are warnings.
    ///
    /// # Errors
    /// [`MeshError::NotFound`], [`MeshError::Read`], [`MeshError::UnknownFormat`],
    /// [`MeshError::Malformed`], [`MeshError::Unsupported`] or [`MeshError::TooLarge`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self, MeshError> {
        let path = path.as_ref();
        let bytes = crate::arrays::read_file(path, crate::limits::MAX_FILE_BYTES)?;
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let folder = path.parent().unwrap_or(Path::new(""));
        let suffix = path.extension().map(|s| s.to_string_lossy().to_ascii_lowercase());
        match suffix.as_deref() {
            Some("obj") => crate::obj::read(&bytes, folder, &name),
            Some("gltf" | "glb") => crate::gltf::read(&bytes, Some(folder), &name),
            _ if bytes.starts_with(b"glTF") => crate::gltf::read(&bytes, Some(folder), &name),
            _ => Err(MeshError::UnknownFormat { name }),
        }
    }

    /// Reads glTF or GLB from memory. `folder` is where relative buffer and image files are looked
    /// for; without it such references are an error or a warning.
    ///
    /// # Errors
    /// As [`Mesh::open`].
    pub fn from_gltf(bytes: &[u8], folder: Option<&Path>) -> Result<Self, MeshError> {
        crate::gltf::read(bytes, folder, "glTF")
    }

    /// Reads OBJ from memory. `folder` is where material libraries and textures are looked for.
    ///
    /// # Errors
    /// As [`Mesh::open`].
    pub fn from_obj(bytes: &[u8], folder: &Path) -> Result<Self, MeshError> {
        crate::obj::read(bytes, folder, "OBJ")
    }

    /// Makes a mesh from plain arrays: `positions` in mesh units, `indices` of triangles, `uvs`
    /// with `v` down, optionally `normals` (any length but zero) and `tangents` (glTF's).
    ///
    /// Without normals, each vertex gets the angle-weighted mean over the triangles that use it.
    /// Without tangents, MikkTSpace is run, and vertices are split where its tangents differ:
    /// vertex `i` stays vertex `i`, the extra ones follow at the end.
    ///
    /// # Errors
    /// [`MeshError::Arrays`] for an empty mesh, mismatched lengths, an index out of range, NaN or
    /// infinity; [`MeshError::TooLarge`].
    pub fn from_arrays(
        positions: &[[f32; 3]],
        indices: &[[u32; 3]],
        uvs: &[[f32; 2]],
        normals: Option<&[[f32; 3]]>,
        tangents: Option<&[[f32; 4]]>,
    ) -> Result<Self, MeshError> {
        let arrays = Arrays {
            positions: positions.iter().map(|&p| Vec3::from(p)).collect(),
            normals: normals.map(|n| n.iter().map(|&n| Vec3::from(n)).collect()),
            uvs: uvs.iter().map(|&t| Vec2::from(t)).collect(),
            tangents: tangents.map(|t| t.iter().map(|&t| Vec4::from(t)).collect()),
            indices: indices.to_vec(),
        };
        let mut mesh = Self::assemble(checked(arrays)?, &[])?;
        mesh.parts =
            vec![Part { name: String::new(), triangles: 0..mesh.indices.len() as u32, material: None }];
        Ok(mesh)
    }

    /// Finishes checked arrays: normals, tangents (splitting vertices) and derivatives. No parts.
    /// `quads` names, in order, each triangle that makes a quad with the next one.
    pub(crate) fn assemble(arrays: Arrays, quads: &[u32]) -> Result<Self, MeshError> {
        let mut warnings = Vec::new();
        let mut mesh = Self {
            normals: crate::normals::complete(&arrays, &mut warnings),
            positions: arrays.positions,
            uvs: arrays.uvs,
            indices: arrays.indices,
            quads: quads.to_vec(),
            ..Self::default()
        };
        match arrays.tangents {
            Some(given) => {
                mesh.tangents = crate::frame::convention::repair(&given, &mesh.normals, &mut warnings);
            }
            None => {
                let split = mesh.tangents(FrameMethod::MIKKTSPACE)?;
                mesh.apply(split, &mut warnings);
            }
        }
        mesh.derive(&mut warnings);
        mesh.warnings = warnings;
        Ok(mesh)
    }

    /// Tangents of this mesh by another method; the mesh itself stays as it is.
    ///
    /// # Errors
    /// [`MeshError::TooLarge`] when splitting would make too many vertices.
    pub fn tangents(&self, method: FrameMethod) -> Result<Split, MeshError> {
        let Self { positions, normals, uvs, indices, quads, .. } = self;
        Surface { positions, normals, uvs, indices, quads }.tangents(method)
    }

    /// This mesh with its vertices split and its frames replaced by another method's.
    ///
    /// # Errors
    /// As [`Mesh::tangents`].
    pub fn with_tangents(&self, method: FrameMethod) -> Result<Self, MeshError> {
        let mut mesh = self.clone();
        let split = self.tangents(method)?;
        let mut warnings = std::mem::take(&mut mesh.warnings);
        let source = split.source.clone();
        mesh.apply(split, &mut warnings);
        mesh.dpdu = source.iter().map(|&i| self.dpdu[i as usize]).collect();
        mesh.dpdv = source.iter().map(|&i| self.dpdv[i as usize]).collect();
        mesh.warnings = warnings;
        Ok(mesh)
    }

    /// `dN/du` and `dN/dv` (`v` down) of the smooth normals at each vertex, per UV unit: what a relief
    /// needs to know of the surface's curvature. Zero where the UVs are degenerate.
    pub fn normal_derivatives(&self) -> [Vec<Vec3>; 2] {
        normal_derivatives(&self.positions, &self.normals, &self.uvs, &self.indices)
    }

    /// Smallest and largest corner of the box around the vertices.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let first = self.positions.first().copied().unwrap_or(Vec3::ZERO);
        self.positions.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p)))
    }

    fn apply(&mut self, split: Split, warnings: &mut Vec<String>) {
        let source = &split.source;
        self.positions = source.iter().map(|&i| self.positions[i as usize]).collect();
        self.normals = source.iter().map(|&i| self.normals[i as usize]).collect();
        self.uvs = source.iter().map(|&i| self.uvs[i as usize]).collect();
        self.indices = split.indices;
        self.tangents = split.tangents;
        warnings.extend(split.warnings);
    }

    fn derive(&mut self, warnings: &mut Vec<String>) {
        let found = derivatives(&self.positions, &self.normals, &self.uvs, &self.tangents, &self.indices);
        self.dpdu = found.dpdu;
        self.dpdv = found.dpdv;
        warnings.extend(found.warnings);
    }
}

/// Most warnings kept: a hostile file can earn one for each of a million primitives.
const MAX_WARNINGS: usize = 100;

/// Drops repeated warnings and those beyond the limit.
pub(crate) fn trim_warnings(warnings: &mut Vec<String>) {
    let mut seen = std::collections::HashSet::new();
    warnings.retain(|w| seen.insert(w.clone()));
    if warnings.len() > MAX_WARNINGS {
        let left = warnings.len() - MAX_WARNINGS;
        warnings.truncate(MAX_WARNINGS);
        warnings.push(format!("... and {left} more"));
    }
}
