//! Accessors: typed, strided, quantised, sparse; every range checked once, then read by element.

use std::collections::HashMap;

use gltf::json::accessor::{Accessor, ComponentType, IndexComponentType, Type};
use gltf::json::validation::Checked;

use super::buffers::Buffers;
use crate::error::MeshError;
use crate::limits::{MAX_ELEMENTS, check_elements};

/// Most elements of an accessor that no data stands behind.
const MAX_ZEROS: usize = 1 << 20;

/// A checked accessor whose elements have `N` components.
pub(super) struct Elements<'a, const N: usize> {
    count: usize,
    component: ComponentType,
    normalized: bool,
    /// Bytes and stride; `None` reads as zeros.
    data: Option<(&'a [u8], usize)>,
    sparse: HashMap<u32, &'a [u8]>,
}

fn size(component: ComponentType) -> usize {
    match component {
        ComponentType::I8 | ComponentType::U8 => 1,
        ComponentType::I16 | ComponentType::U16 => 2,
        ComponentType::U32 | ComponentType::F32 => 4,
    }
}

/// Number of elements of accessor `index`, unread.
pub(super) fn count(buffers: &Buffers<'_>, index: usize) -> Result<usize, MeshError> {
    let accessors = &buffers.root.accessors;
    let accessor = accessors.get(index).ok_or_else(|| buffers.missing("accessor", index, accessors.len()))?;
    Ok(usize::try_from(accessor.count.0).unwrap_or(usize::MAX))
}

/// Replaced elements of accessor `index`: what it costs to open it.
pub(super) fn replaced(buffers: &Buffers<'_>, index: usize) -> u64 {
    let accessor = buffers.root.accessors.get(index);
    accessor.and_then(|a| a.sparse.as_ref()).map_or(0, |sparse| sparse.count.0)
}

impl<'a, const N: usize> Elements<'a, N> {
    /// Checks accessor `index` in full; `what` is what it stands for, used in messages.
    pub fn new(buffers: &'a Buffers<'_>, index: usize, what: &str) -> Result<Self, MeshError> {
        let count = count(buffers, index)?;
        let accessor = &buffers.root.accessors[index];
        let fail = |problem: String| buffers.fail(format!("{what}, accessor {index}: {problem}"));
        let expected = match N {
            1 => Type::Scalar,
            2 => Type::Vec2,
            3 => Type::Vec3,
            _ => Type::Vec4,
        };
        if accessor.type_ != Checked::Valid(expected) {
            return Err(fail(format!("type {}; {expected:?} expected", shown(&accessor.type_))));
        }
        let Checked::Valid(component) = accessor.component_type else {
            return Err(fail("unknown component type".to_owned()));
        };
        let component = component.0;
        let bytes = N * size(component);
        if count == 0 {
            return Err(fail("no elements".to_owned()));
        }
        check_elements(&format!("elements in accessor {index} ({what})"), count)?;
        let data = match accessor.buffer_view {
            None if count > MAX_ZEROS => {
                return Err(fail(format!("{count} elements without a buffer view")));
            }
            None => None,
            Some(view) => {
                let view = buffers.view(view.value())?;
                let stride = view.stride.unwrap_or(bytes);
                let start = accessor.byte_offset.map_or(0, |o| o.0);
                let data = range(view.bytes, start, count, stride, bytes).map_err(fail)?;
                Some((data, stride))
            }
        };
        let sparse = sparse(buffers, accessor, count, bytes).map_err(|problem| match problem {
            Problem::Here(text) => fail(text),
            Problem::Elsewhere(error) => error,
        })?;
        Ok(Self { count, component, normalized: accessor.normalized, data, sparse })
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.count
    }

    fn bytes(&self, index: usize) -> Option<&'a [u8]> {
        match self.sparse.get(&(index as u32)) {
            Some(bytes) => Some(bytes),
            None => self.data.map(|(data, stride)| &data[index * stride..]),
        }
    }

    /// Element `index`, which must be below [`Self::len`], as floats: integers are normalised when
    /// the accessor says so and cast otherwise.
    pub fn get(&self, index: usize) -> [f32; N] {
        let Some(bytes) = self.bytes(index) else { return [0.0; N] };
        std::array::from_fn(|i| {
            let at = &bytes[i * size(self.component)..];
            let (value, scale) = match self.component {
                ComponentType::I8 => (f32::from(at[0] as i8), 127.0),
                ComponentType::U8 => (f32::from(at[0]), 255.0),
                ComponentType::I16 => (f32::from(i16::from_le_bytes([at[0], at[1]])), 32767.0),
                ComponentType::U16 => (f32::from(u16::from_le_bytes([at[0], at[1]])), 65535.0),
                ComponentType::U32 => return word(at) as f32,
                ComponentType::F32 => return f32::from_bits(word(at)),
            };
            if self.normalized { (value / scale).max(-1.0) } else { value }
        })
    }
}

impl Elements<'_, 1> {
    /// All elements as unsigned integers; `None` when they are of another kind.
    pub fn integers(&self) -> Option<Vec<u32>> {
        let read: fn(&[u8]) -> u32 = match self.component {
            ComponentType::U8 => |b| u32::from(b[0]),
            ComponentType::U16 => |b| u32::from(u16::from_le_bytes([b[0], b[1]])),
            ComponentType::U32 => word,
            _ => return None,
        };
        Some((0..self.count).map(|i| self.bytes(i).map_or(0, read)).collect())
    }
}

fn word(bytes: &[u8]) -> u32 {
    u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

fn shown(kind: &Checked<Type>) -> String {
    match kind {
        Checked::Valid(kind) => format!("{kind:?}"),
        Checked::Invalid => "unknown".to_owned(),
    }
}

/// The bytes of `count` elements of `size` bytes, `stride` apart, from `start`.
fn range(data: &[u8], start: u64, count: usize, stride: usize, size: usize) -> Result<&[u8], String> {
    if stride < size {
        return Err(format!("stride of {stride} bytes for elements of {size}"));
    }
    let end = (count as u64 - 1)
        .checked_mul(stride as u64)
        .and_then(|span| span.checked_add(size as u64))
        .and_then(|span| span.checked_add(start));
    let range = usize::try_from(start).ok().zip(end.and_then(|end| usize::try_from(end).ok()));
    range.and_then(|(start, end)| data.get(start..end)).ok_or_else(|| {
        format!(
            "{count} elements of {size} bytes, {stride} apart, from byte {start} do not fit into {} bytes",
            data.len()
        )
    })
}

enum Problem {
    Here(String),
    Elsewhere(MeshError),
}

impl From<String> for Problem {
    fn from(text: String) -> Self {
        Self::Here(text)
    }
}

impl From<MeshError> for Problem {
    fn from(error: MeshError) -> Self {
        Self::Elsewhere(error)
    }
}

/// The replaced elements of a sparse accessor.
fn sparse<'a>(
    buffers: &'a Buffers<'_>,
    accessor: &Accessor,
    count: usize,
    size: usize,
) -> Result<HashMap<u32, &'a [u8]>, Problem> {
    let Some(sparse) = &accessor.sparse else { return Ok(HashMap::new()) };
    let replaced = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
    if replaced == 0 || replaced > count.min(MAX_ELEMENTS) {
        return Err(format!("sparse count {replaced} for {count} elements").into());
    }
    let Checked::Valid(IndexComponentType(component)) = sparse.indices.component_type else {
        return Err("unknown component type of sparse indices".to_owned().into());
    };
    let width = self::size(component);
    let view = buffers.view(sparse.indices.buffer_view.value())?;
    let indices = range(view.bytes, sparse.indices.byte_offset.0, replaced, width, width)?;
    let view = buffers.view(sparse.values.buffer_view.value())?;
    let values = range(view.bytes, sparse.values.byte_offset.0, replaced, size, size)?;
    let mut map = HashMap::with_capacity(replaced);
    for (index, value) in indices.chunks_exact(width).zip(values.chunks_exact(size)) {
        let index = index.iter().rev().fold(0u32, |n, &byte| n << 8 | u32::from(byte));
        if index as usize >= count {
            return Err(format!("sparse index {index} for {count} elements").into());
        }
        map.insert(index, value);
    }
    Ok(map)
}
