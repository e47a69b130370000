//! Settings that cannot take effect.

use crate::{Request, Scene};

/// What is to be said about a scene and what is asked of its pictures.
pub(crate) fn warnings(scene: &Scene<'_>, request: &Request) -> Vec<String> {
    let mut warnings = Vec::new();
    let name = request.technique.name();
    if request.horizon.is_some() && request.in_shell() {
        warnings.push("silhouettes=True casts its own shadows; horizon shadows have no effect".to_owned());
    } else if request.horizon.is_some() && !request.technique.takes_horizon() {
        warnings.push(format!("technique {name:?} takes no horizon map; horizon shadows have no effect"));
    } else if request.shadows == Some(true) && request.horizon.is_none() && !request.technique.casts_shadows()
    {
        warnings.push(format!("technique {name:?} casts no shadows; shadows=True has no effect"));
    }
    if request.silhouettes && !request.technique.has_silhouettes() && !request.technique.draws_geometry() {
        warnings.push(format!(
            "technique {name:?} has no true outlines, only \"exact\" has; silhouettes=True has no effect"
        ));
    }
    if request.technique.name() == "dot3" {
        if scene.lights.len() > 1 {
            warnings.push(format!("dot3 knows one light; the first of {} is used", scene.lights.len()));
        }
        if scene.draws.iter().any(|draw| draw.material.specular > 0.0) {
            warnings.push("dot3 is diffuse only; specular has no effect".to_owned());
        }
    }
    warnings
}
