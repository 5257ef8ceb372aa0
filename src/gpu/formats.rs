//! What a plan's attributes and resources are in the graphics interface's words.

use wgpu::{
    BindingType, BufferBindingType, SamplerBindingType, TextureSampleType, TextureViewDimension, VertexFormat,
};

use crate::shader::Attribute;
use crate::shader::quantity::Kind;

pub(super) fn binding_type(kind: Kind) -> BindingType {
    let texture = |filterable, view_dimension| BindingType::Texture {
        sample_type: TextureSampleType::Float { filterable },
        view_dimension,
        multisampled: false,
    };
    match kind {
        Kind::Faces => texture(false, TextureViewDimension::D2Array),
        Kind::Cube => texture(true, TextureViewDimension::Cube),
        Kind::Texels => texture(false, TextureViewDimension::D2),
        Kind::Map => texture(true, TextureViewDimension::D2),
        Kind::Sampler => BindingType::Sampler(SamplerBindingType::Filtering),
        Kind::Depth => BindingType::Texture {
            sample_type: TextureSampleType::Depth,
            view_dimension: TextureViewDimension::D2Array,
            multisampled: false,
        },
        Kind::Comparison => BindingType::Sampler(SamplerBindingType::Comparison),
        Kind::Storage | Kind::Rows => BindingType::Buffer {
            ty: BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
    }
}

pub(super) fn vertex_format(attribute: Attribute) -> VertexFormat {
    match attribute {
        Attribute::Chart => VertexFormat::Float32,
        Attribute::Position | Attribute::Normal | Attribute::Corner => VertexFormat::Float32x3,
        Attribute::Tangent | Attribute::Weights => VertexFormat::Float32x4,
        Attribute::Uv | Attribute::AtlasUv => VertexFormat::Float32x2,
        Attribute::Occlusion => VertexFormat::Float32,
        Attribute::Joints => VertexFormat::Uint32x4,
        Attribute::Field(field) => match field.info().numbers {
            1 => VertexFormat::Float32,
            2 => VertexFormat::Float32x2,
            _ => VertexFormat::Float32x3,
        },
    }
}
