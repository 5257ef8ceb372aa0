//! Typed arrays out of buffers: strided, sparse, normalised or neither.

use gltf::json;
use json::Index;
use json::accessor::{Accessor, ComponentType, GenericComponentType, Type};
use json::validation::Checked;

use super::document::Document;
use crate::error::SceneError;

/// The most elements of an accessor; what it takes in memory is then bounded too.
const MOST_ELEMENTS: u64 = 1 << 26;
/// The same for an accessor of zeros, which costs a file nothing.
const MOST_ZEROS: u64 = 1 << 22;

impl Document {
    /// An accessor's elements as floats; normalised integers are in [-1, 1] or [0, 1].
    pub(super) fn floats<const N: usize>(&self, index: Index<Accessor>) -> Result<Vec<[f32; N]>, SceneError> {
        let normalized = self.get(&self.root.accessors, index, "accessor")?.normalized;
        self.read(index, |kind, bytes| {
            let value = component(kind, bytes);
            let most = match kind {
                ComponentType::I8 => 127.0,
                ComponentType::U8 => 255.0,
                ComponentType::I16 => 32767.0,
                ComponentType::U16 => 65535.0,
                ComponentType::U32 => f64::from(u32::MAX),
                ComponentType::F32 => return value as f32,
            };
            if normalized { (value / most).max(-1.0) as f32 } else { value as f32 }
        })
    }

    /// An accessor's elements as unsigned integers (indices, joints).
    pub(super) fn integers<const N: usize>(
        &self,
        index: Index<Accessor>,
    ) -> Result<Vec<[u32; N]>, SceneError> {
        let accessor = self.get(&self.root.accessors, index, "accessor")?;
        let unsigned = matches!(
            accessor.component_type,
            Checked::Valid(GenericComponentType(ComponentType::U8 | ComponentType::U16 | ComponentType::U32))
        );
        if !unsigned {
            return Err(self.kind_error(index, "does not hold unsigned integers"));
        }
        self.read(index, |kind, bytes| component(kind, bytes) as u32)
    }

    /// A scalar accessor.
    pub(super) fn scalars(&self, index: Index<Accessor>) -> Result<Vec<f32>, SceneError> {
        Ok(self.floats::<1>(index)?.into_iter().flatten().collect())
    }

    /// Every element, component by component; an accessor without bytes is zero, and sparse elements
    /// replace what is there.
    fn read<T: Copy + Default, const N: usize>(
        &self,
        index: Index<Accessor>,
        convert: impl Fn(ComponentType, &[u8]) -> T,
    ) -> Result<Vec<[T; N]>, SceneError> {
        let accessor = self.get(&self.root.accessors, index, "accessor")?;
        let Checked::Valid(GenericComponentType(kind)) = accessor.component_type else {
            return Err(self.kind_error(index, "has an unknown component type"));
        };
        match accessor.type_ {
            Checked::Valid(shape)
                if shape.multiplicity() == N && !matches!(shape, Type::Mat2 | Type::Mat3) => {}
            _ => return Err(self.kind_error(index, &format!("does not hold {N} components an element"))),
        }
        let count = accessor.count.0;
        let most = if accessor.buffer_view.is_some() { MOST_ELEMENTS } else { MOST_ZEROS };
        if count > most {
            return Err(self.kind_error(index, &format!("claims {count} elements, more than {most}")));
        }
        let count = count as usize;
        let element = |bytes: &[u8]| -> [T; N] {
            std::array::from_fn(|c| convert(kind, &bytes[c * kind.size()..(c + 1) * kind.size()]))
        };
        let size = N * kind.size();
        let mut values = match accessor.buffer_view {
            None => vec![[T::default(); N]; count],
            Some(view) => {
                let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
                let stride = self.get(&self.root.buffer_views, view, "buffer view")?.byte_stride;
                let stride = stride.map_or(size, |stride| stride.0);
                let bytes = slice(self.view(view)?, offset, count, stride, size)
                    .ok_or_else(|| self.outside("accessor", index.value()))?;
                (0..count).map(|i| element(&bytes[i * stride..i * stride + size])).collect()
            }
        };
        if let Some(sparse) = &accessor.sparse {
            let outside = || self.outside("sparse accessor", index.value());
            let Checked::Valid(json::accessor::IndexComponentType(index_kind)) =
                sparse.indices.component_type
            else {
                return Err(self.kind_error(index, "has sparse indices of an unknown type"));
            };
            let n = usize::try_from(sparse.count.0).ok().filter(|&n| n <= count).ok_or_else(outside)?;
            let width = index_kind.size();
            let places = self.view(sparse.indices.buffer_view)?;
            let places = slice(places, sparse.indices.byte_offset.0, n, width, width).ok_or_else(outside)?;
            let replaced = self.view(sparse.values.buffer_view)?;
            let replaced = slice(replaced, sparse.values.byte_offset.0, n, size, size).ok_or_else(outside)?;
            for i in 0..n {
                let place = component(index_kind, &places[i * width..(i + 1) * width]) as usize;
                let value = element(&replaced[i * size..(i + 1) * size]);
                *values.get_mut(place).ok_or_else(outside)? = value;
            }
        }
        Ok(values)
    }

    fn kind_error(&self, index: Index<Accessor>, what: &str) -> SceneError {
        self.error(what, "The file is damaged or not glTF 2.0: export it anew")
            .at(format!("accessor {}", index.value()))
    }
}

/// The bytes from `offset` on, if `count` elements of `size` every `stride` fit in them.
fn slice(bytes: &[u8], offset: u64, count: usize, stride: usize, size: usize) -> Option<&[u8]> {
    let rest = bytes.get(usize::try_from(offset).ok()?..)?;
    if count == 0 {
        return Some(rest);
    }
    let needed = (count - 1).checked_mul(stride)?.checked_add(size)?;
    (stride >= size && needed <= rest.len()).then_some(rest)
}

/// One little-endian component; exact in f64 for every type.
fn component(kind: ComponentType, bytes: &[u8]) -> f64 {
    let at = |i: usize| bytes.get(i).copied().unwrap_or(0);
    let (two, four) = ([at(0), at(1)], [at(0), at(1), at(2), at(3)]);
    match kind {
        ComponentType::I8 => i8::from_le_bytes([at(0)]).into(),
        ComponentType::U8 => at(0).into(),
        ComponentType::I16 => i16::from_le_bytes(two).into(),
        ComponentType::U16 => u16::from_le_bytes(two).into(),
        ComponentType::U32 => u32::from_le_bytes(four).into(),
        ComponentType::F32 => f32::from_le_bytes(four).into(),
    }
}
