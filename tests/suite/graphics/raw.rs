//! A graphics adapter as another engine uses it: shaders and textures of its own, one draw after another.

use exr::prelude::f16;
use skinfit::gpu::Gpu;
use skinfit::model::cube::Cube;
use wgpu::util::{BufferInitDescriptor, DeviceExt as _, TextureDataOrder};
use wgpu::{
    BindGroupDescriptor, BindGroupEntry, BindGroupLayoutDescriptor, BindGroupLayoutEntry, BindingResource,
    BindingType, Buffer, BufferDescriptor, BufferUsages, Color, ColorTargetState, ColorWrites,
    CommandEncoderDescriptor, CompareFunction, DepthStencilState, Extent3d, FragmentState, IndexFormat,
    LoadOp, MapMode, Operations, PipelineLayoutDescriptor, PollType, PrimitiveState,
    RenderPassColorAttachment, RenderPassDepthStencilAttachment, RenderPassDescriptor, RenderPipeline,
    RenderPipelineDescriptor, SamplerBindingType, SamplerDescriptor, ShaderModule, ShaderModuleDescriptor,
    ShaderSource, ShaderStages, StoreOp, TexelCopyBufferInfo, TexelCopyBufferLayout, Texture,
    TextureDescriptor, TextureDimension, TextureFormat, TextureSampleType, TextureUsages,
    TextureViewDescriptor, TextureViewDimension, VertexAttribute, VertexBufferLayout, VertexFormat,
    VertexState, VertexStepMode,
};

use super::exported::as_wgsl;

/// What a draw writes.
const FORMAT: TextureFormat = TextureFormat::Rgba32Float;
const DEPTH: TextureFormat = TextureFormat::Depth32Float;
/// How many bindings after a texture that is a cube its sampler stands.
pub(crate) const SAMPLER: u32 = 100;

/// The adapter, with a mesh' triangles.
pub(crate) struct Raw<'a> {
    gpu: &'a Gpu,
    indices: Buffer,
    count: u32,
}

/// What a shader reads.
#[derive(Clone, Copy)]
pub(crate) enum Sampled<'a> {
    /// Texel by texel.
    Texels(&'a Texture),
    /// With a bilinear sampler.
    Cube(&'a Texture),
}

/// A draw of the mesh, or of the whole image.
pub(crate) struct Drawn<'a> {
    /// GLSL; its inputs are the vertices' fields, location by location.
    pub(crate) fragment: &'a str,
    /// For each field what each vertex has.
    pub(crate) vertices: &'a [&'a [Vec<f32>]],
    /// Where vertices are in clip space; `None`: the whole image.
    pub(crate) clip: Option<&'a Vec<[f32; 4]>>,
    /// By binding.
    pub(crate) bound: &'a [(u32, Sampled<'a>)],
    /// Pixels along a side.
    pub(crate) size: u32,
}

impl<'a> Raw<'a> {
    pub(crate) fn new(gpu: &'a Gpu, triangles: &[[u32; 3]]) -> Self {
        let descriptor = BufferInitDescriptor {
            label: None,
            contents: bytemuck::cast_slice(triangles),
            usage: BufferUsages::INDEX,
        };
        let indices = gpu.device.create_buffer_init(&descriptor);
        Self { gpu, indices, count: 3 * triangles.len() as u32 }
    }

    /// A cube map in 16 bits.
    pub(crate) fn cube(&self, cube: &Cube<f32>) -> Texture {
        let size = cube.size();
        let mut halves: Vec<u16> = Vec::new();
        for face in 0..6 {
            for row in 0..size {
                for column in 0..size {
                    halves.extend(cube.texel(face, column, row).map(|x| f16::from_f32(x).to_bits()));
                }
            }
        }
        let usage = TextureUsages::TEXTURE_BINDING;
        let descriptor = texture(size as u32, 6, TextureFormat::Rgba16Float, usage);
        let bytes = bytemuck::cast_slice(&halves);
        self.gpu.device.create_texture_with_data(
            &self.gpu.queue,
            &descriptor,
            TextureDataOrder::LayerMajor,
            bytes,
        )
    }

    /// The image that a draw leaves, black where nothing is drawn.
    pub(crate) fn draw(&self, drawn: &Drawn<'_>) -> Texture {
        let device = &self.gpu.device;
        let usage =
            TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_SRC;
        let image = device.create_texture(&texture(drawn.size, 1, FORMAT, usage));
        let depth = device.create_texture(&texture(drawn.size, 1, DEPTH, TextureUsages::RENDER_ATTACHMENT));
        let [image_view, depth_view] =
            [&image, &depth].map(|made| made.create_view(&TextureViewDescriptor::default()));
        let (layout, bound) = self.bind(drawn.bound);
        let pipeline = self.pipeline(drawn, &layout);
        let vertices = drawn.clip.map(|clip| self.vertices(clip, drawn.vertices));
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            color_attachments: &[Some(RenderPassColorAttachment {
                view: &image_view,
                depth_slice: None,
                resolve_target: None,
                ops: Operations { load: LoadOp::Clear(Color::TRANSPARENT), store: StoreOp::Store },
            })],
            depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                view: &depth_view,
                depth_ops: Some(Operations { load: LoadOp::Clear(1.0), store: StoreOp::Discard }),
                stencil_ops: None,
            }),
            ..RenderPassDescriptor::default()
        });
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &bound, &[]);
        match &vertices {
            Some(vertices) => {
                pass.set_vertex_buffer(0, vertices.slice(..));
                pass.set_index_buffer(self.indices.slice(..), IndexFormat::Uint32);
                pass.draw_indexed(0..self.count, 0, 0..1);
            }
            None => pass.draw(0..3, 0..1),
        }
        drop(pass);
        self.gpu.queue.submit([encoder.finish()]);
        image
    }

    /// Its numbers, four a pixel.
    pub(crate) fn read(&self, image: &Texture, size: u32) -> Vec<f32> {
        let device = &self.gpu.device;
        let (row, bytes) = (16 * size, u64::from(16 * size * size));
        let usage = BufferUsages::COPY_DST | BufferUsages::MAP_READ;
        let buffer = device.create_buffer(&BufferDescriptor {
            label: None,
            size: bytes,
            usage,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        let layout = TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
        let extent = Extent3d { width: size, height: size, depth_or_array_layers: 1 };
        let target = TexelCopyBufferInfo { buffer: &buffer, layout };
        encoder.copy_texture_to_buffer(image.as_image_copy(), target, extent);
        self.gpu.queue.submit([encoder.finish()]);
        buffer.slice(..).map_async(MapMode::Read, |mapped| mapped.unwrap());
        device.poll(PollType::wait_indefinitely()).unwrap();
        let view = buffer.slice(..).get_mapped_range().unwrap();
        bytemuck::cast_slice(&view).to_vec()
    }

    fn bind(&self, bound: &[(u32, Sampled<'_>)]) -> (wgpu::BindGroupLayout, wgpu::BindGroup) {
        let device = &self.gpu.device;
        let filter = wgpu::FilterMode::Linear;
        let sampler = device.create_sampler(&SamplerDescriptor {
            mag_filter: filter,
            min_filter: filter,
            ..SamplerDescriptor::default()
        });
        let (mut kinds, mut views) = (Vec::new(), Vec::new());
        let entry = |binding, ty| BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        for (binding, sampled) in bound {
            let (texture, view_dimension, filterable) = match sampled {
                Sampled::Texels(texture) => (texture, TextureViewDimension::D2, false),
                Sampled::Cube(texture) => (texture, TextureViewDimension::Cube, true),
            };
            let sample_type = TextureSampleType::Float { filterable };
            kinds.push(entry(
                *binding,
                BindingType::Texture { sample_type, view_dimension, multisampled: false },
            ));
            let dimension = Some(view_dimension);
            views.push((
                *binding,
                texture.create_view(&TextureViewDescriptor { dimension, ..TextureViewDescriptor::default() }),
            ));
            if filterable {
                kinds.push(entry(binding + SAMPLER, BindingType::Sampler(SamplerBindingType::Filtering)));
            }
        }
        let layout =
            device.create_bind_group_layout(&BindGroupLayoutDescriptor { label: None, entries: &kinds });
        let samplers = kinds.iter().filter(|kind| kind.binding >= SAMPLER);
        let textures = views.iter().map(|(binding, view)| BindGroupEntry {
            binding: *binding,
            resource: BindingResource::TextureView(view),
        });
        let samplers = samplers.map(|kind| BindGroupEntry {
            binding: kind.binding,
            resource: BindingResource::Sampler(&sampler),
        });
        let entries: Vec<_> = textures.chain(samplers).collect();
        let group = device.create_bind_group(&BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &entries,
        });
        (layout, group)
    }

    /// Clip coordinates, then each field, vertex by vertex.
    fn vertices(&self, clip: &[[f32; 4]], fields: &[&[Vec<f32>]]) -> Buffer {
        let mut numbers: Vec<f32> = Vec::new();
        for (i, clip) in clip.iter().enumerate() {
            numbers.extend(clip);
            fields.iter().for_each(|field| numbers.extend(&field[i]));
        }
        let contents = bytemuck::cast_slice(&numbers);
        self.gpu.device.create_buffer_init(&BufferInitDescriptor {
            label: None,
            contents,
            usage: BufferUsages::VERTEX,
        })
    }

    fn pipeline(&self, drawn: &Drawn<'_>, layout: &wgpu::BindGroupLayout) -> RenderPipeline {
        let device = &self.gpu.device;
        let sizes: Vec<usize> = drawn.vertices.iter().map(|field| field[0].len()).collect();
        let vertex = self.module(&vertex_shader(&sizes, drawn.clip.is_none()));
        let fragment = self.module(&as_wgsl(drawn.fragment));
        let mut attributes =
            vec![VertexAttribute { format: VertexFormat::Float32x4, offset: 0, shader_location: 0 }];
        let mut offset = 16;
        for (shader_location, &size) in (1..).zip(&sizes) {
            let format = [VertexFormat::Float32, VertexFormat::Float32x2, VertexFormat::Float32x3][size - 1];
            attributes.push(VertexAttribute { format, offset, shader_location });
            offset += 4 * size as u64;
        }
        let buffers = [Some(VertexBufferLayout {
            array_stride: offset,
            step_mode: VertexStepMode::Vertex,
            attributes: &attributes,
        })];
        let layouts = [Some(layout)];
        let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            bind_group_layouts: &layouts,
            ..PipelineLayoutDescriptor::default()
        });
        device.create_render_pipeline(&RenderPipelineDescriptor {
            label: None,
            layout: Some(&pipeline_layout),
            vertex: VertexState {
                module: &vertex,
                entry_point: Some("vs_main"),
                compilation_options: Default::default(),
                buffers: if drawn.clip.is_some() { &buffers } else { &[] },
            },
            primitive: PrimitiveState::default(),
            depth_stencil: Some(DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(CompareFunction::LessEqual),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(FragmentState {
                module: &fragment,
                entry_point: Some("main"),
                compilation_options: Default::default(),
                targets: &[Some(ColorTargetState {
                    format: FORMAT,
                    blend: None,
                    write_mask: ColorWrites::ALL,
                })],
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    fn module(&self, wgsl: &str) -> ShaderModule {
        let source = ShaderSource::Wgsl(wgsl.into());
        self.gpu.device.create_shader_module(ShaderModuleDescriptor { label: None, source })
    }
}

/// A vertex shader that hands fields of these sizes on; of the whole image one triangle that covers it.
fn vertex_shader(sizes: &[usize], whole: bool) -> String {
    if whole {
        return "@vertex\nfn vs_main(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {\n    let at = vec2f(f32(i & 1u), f32(i >> 1u));\n    return vec4f(4.0 * at - 1.0, 0.5, 1.0);\n}\n".to_owned();
    }
    let kind = |size: usize| ["f32", "vec2f", "vec3f"][size - 1];
    let (mut given, mut handed, mut set) = (String::new(), String::new(), String::new());
    for (i, &size) in sizes.iter().enumerate() {
        given += &format!(", @location({}) field_{i}: {}", i + 1, kind(size));
        handed += &format!("    @location({i}) field_{i}: {},\n", kind(size));
        set += &format!(", field_{i}");
    }
    format!(
        "struct Handed {{\n    @builtin(position) clip: vec4f,\n{handed}}}\n@vertex\nfn vs_main(@location(0) clip: vec4f{given}) -> \
         Handed {{\n    return Handed(clip{set});\n}}\n"
    )
}

fn texture(
    size: u32,
    layers: u32,
    format: TextureFormat,
    usage: TextureUsages,
) -> TextureDescriptor<'static> {
    TextureDescriptor {
        label: None,
        size: Extent3d { width: size, height: size, depth_or_array_layers: layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    }
}
