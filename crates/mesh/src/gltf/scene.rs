//! The node tree of the scene, flattened to meshes with their transforms.

use glam::{DMat4, DQuat, DVec3};
use gltf::json::{Node, Root};

use crate::error::MeshError;

/// A mesh placed in the scene.
pub(super) struct Instance {
    /// Index of the mesh.
    pub mesh: usize,
    /// Name of the node; may be empty.
    pub name: String,
    /// Transform from the mesh's own space.
    pub scene_from_mesh: DMat4,
}

/// Every mesh the default scene shows, in the order of the node tree.
pub(super) fn instances(
    root: &Root,
    name: &str,
    warnings: &mut Vec<String>,
) -> Result<Vec<Instance>, MeshError> {
    let fail = |problem: String| MeshError::malformed(name, problem);
    if root.nodes.is_empty() && root.scenes.is_empty() {
        // A library of meshes: nothing places them, so each is shown as it is.
        warnings.push("the file has no scene; its meshes are read where they are".to_owned());
        let as_it_is = |mesh| Instance { mesh, name: String::new(), scene_from_mesh: DMat4::IDENTITY };
        return Ok((0..root.meshes.len()).map(as_it_is).collect());
    }
    let mut found = Vec::new();
    let mut visited = vec![false; root.nodes.len()];
    let mut stack: Vec<(usize, DMat4)> =
        roots(root, name)?.into_iter().rev().map(|node| (node, DMat4::IDENTITY)).collect();
    while let Some((index, scene_from_parent)) = stack.pop() {
        let Some(node) = root.nodes.get(index) else {
            return Err(fail(format!("refers to node {index}, but there are {}", root.nodes.len())));
        };
        if std::mem::replace(&mut visited[index], true) {
            return Err(fail(format!("node {index} appears twice in the scene; nodes must form a tree")));
        }
        let scene_from_node = scene_from_parent * parent_from_node(node);
        if !scene_from_node.is_finite() {
            return Err(fail(format!("the transform of node {index} is not finite")));
        }
        if let Some(mesh) = node.mesh {
            if node.skin.is_some() {
                warnings.push(format!("node {index} is skinned; it is read as modelled, bones ignored"));
            }
            found.push(Instance {
                mesh: mesh.value(),
                name: node.name.clone().unwrap_or_default(),
                scene_from_mesh: scene_from_node,
            });
        }
        let children = node.children.iter().flatten().rev();
        stack.extend(children.map(|child| (child.value(), scene_from_node)));
    }
    Ok(found)
}

/// Root nodes of the default scene; without a scene, all nodes that are nobody's child.
fn roots(root: &Root, name: &str) -> Result<Vec<usize>, MeshError> {
    let chosen = root.scene.map_or(0, |scene| scene.value());
    if let Some(scene) = root.scenes.get(chosen) {
        return Ok(scene.nodes.iter().map(|node| node.value()).collect());
    }
    if root.scene.is_some() {
        let count = root.scenes.len();
        return Err(MeshError::malformed(name, format!("refers to scene {chosen}, but there are {count}")));
    }
    let mut is_child = vec![false; root.nodes.len()];
    for child in root.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
        if let Some(flag) = is_child.get_mut(child.value()) {
            *flag = true;
        }
    }
    Ok((0..root.nodes.len()).filter(|&node| !is_child[node]).collect())
}

fn parent_from_node(node: &Node) -> DMat4 {
    if let Some(matrix) = node.matrix {
        return DMat4::from_cols_array(&matrix.map(f64::from));
    }
    let vector = |v: Option<[f32; 3]>, default| v.map_or(default, |v| DVec3::from(v.map(f64::from)));
    let rotation = node.rotation.map_or(DQuat::IDENTITY, |q| {
        let q = DQuat::from_array(q.0.map(f64::from));
        if q.length_squared() > 0.0 { q.normalize() } else { DQuat::IDENTITY }
    });
    DMat4::from_scale_rotation_translation(
        vector(node.scale, DVec3::ONE),
        rotation,
        vector(node.translation, DVec3::ZERO),
    )
}
