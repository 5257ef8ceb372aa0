//! Samples that the adapter drew, as tensors: from the records that the geometry pass leaves to burn's memory, on one
//! device and without the host.

use std::fmt::Write as _;

use burn::backend::Shape;
use burn::backend::wgpu::{CubeBackend, CubeTensor};
use burn::tensor::{Tensor, TensorData};
use wgpu::{Buffer, BufferUsages, CommandEncoderDescriptor};

use super::adjoint::Adjoint;
use super::buffer::{TensorBuffer, lend, plain};
use super::inputs::Input;
use super::{SharedDevice, TensorError, pass};
use crate::gpu::engine::DeviceSamples;
use crate::gpu::records::StoredRecords;
use crate::samples::surface_records::{Places, neutral};
use crate::samples::{LANES, ViewSamples};

/// The inputs that samples hold.
const OF_SAMPLES: [Input; 5] = [Input::Albedo, Input::Specular, Input::Attenuator, Input::Open, Input::Bump];

/// What an operation takes of samples.
pub(super) struct Planes {
    /// What is no tensor, plane by plane; the share last.
    pub fixed: Buffer,
    /// What is one, where the effects read it.
    pub inputs: Vec<(Input, CubeTensor)>,
}

impl Planes {
    /// Draw the samples of `views`, which came with `made`, and take their numbers to where an operation reads them.
    ///
    /// # Errors
    /// When they are of another device or with other views, or it has no room.
    pub(super) fn draw(
        shared: &SharedDevice,
        adjoint: &Adjoint,
        made: &DeviceSamples,
        views: &[&ViewSamples],
    ) -> Result<Self, TensorError> {
        let gpu = shared.gpu();
        let foreign = |reason: &str| TensorError::Foreign { what: "the samples", reason: reason.to_owned() };
        if !made.gpu().is(gpu) {
            return Err(foreign("they were drawn on another device"));
        }
        if !made.came_with(views) {
            return Err(foreign("the views are not those that came with them, all and in their order"));
        }
        let samples: usize = views.iter().map(|view| view.records() * LANES).sum();
        let read: Vec<Input> = OF_SAMPLES.into_iter().filter(|&input| adjoint.reads(input)).collect();
        let shape = |input: &Input| Shape::new([samples, input.width().unwrap_or(1)]);
        // Burn makes room beside a tensor that is there.
        let one = plain("one", Tensor::<1>::from_data(TensorData::new(vec![0.0_f32], [1]), shared.device()))?;
        let (_one, tensors) = lend(gpu, vec![("one", one)], &read.iter().map(shape).collect::<Vec<_>>())?;
        let planes = 1 + adjoint.fixed().iter().map(|(_, width)| width).sum::<usize>();
        let fixed = gpu.scratch("samples", (4 * planes * samples).max(4) as u64)?;
        let mut first = 0;
        for (index, groups) in views.iter().enumerate() {
            let (records, surface) = made.draw(index, groups)?;
            let text = text(adjoint, &read, surface.places(), surface.rows().stride());
            let pipeline = pass::pipeline(gpu, &pass::module(gpu, "records to tensors", &text)?, "cs_main")?;
            let slots = groups.records() * LANES;
            let counts = [first as u32, slots as u32, samples as u32, 0];
            let counts = gpu.buffer("counts", bytemuck::cast_slice(&counts), BufferUsages::UNIFORM);
            let mut bound = vec![
                (0, counts.as_entire_binding()),
                (1, records.as_entire_binding()),
                (2, fixed.as_entire_binding()),
            ];
            bound.extend((3..).zip(&tensors).map(|(binding, tensor)| (binding, tensor.binding())));
            let label = Some("records to tensors");
            let mut encoder = gpu.device.create_command_encoder(&CommandEncoderDescriptor { label });
            pass::dispatch(gpu, &mut encoder, &pipeline, &[bound], slots as u64);
            gpu.queue.submit([encoder.finish()]);
            gpu.check()?;
            first += slots;
        }
        let tensors = tensors.into_iter().map(TensorBuffer::into_tensor);
        Ok(Self { fixed, inputs: read.into_iter().zip(tensors).collect() })
    }

    /// The tensor of an input, where there is one.
    pub(super) fn tensor(&self, input: Input) -> Option<Tensor<2>> {
        let (_, tensor) = self.inputs.iter().find(|(of, _)| *of == input)?;
        Some(Tensor::from_primitive::<CubeBackend>(tensor.clone()))
    }
}

/// The module that takes a view's records to the planes and the tensors, a sample a thread.
fn text(adjoint: &Adjoint, read: &[Input], places: &Places, rows: usize) -> String {
    let stored = StoredRecords { name: "records", rows };
    let number = |field: &str, c: usize| {
        let row = |name: &str| places.fields().find(|(field, ..)| *field == name).map(|(_, row, _)| row + c);
        let row = row(field).or_else(|| if field == "normal" { row("base") } else { None });
        let neutral = || format!("{:?}", neutral(field).unwrap_or(0.0));
        row.map_or_else(neutral, |row| stored.number("record", row))
    };
    let mut wgsl = String::from(
        "// The first sample of the view, how many it has, and how many there are.\n\
         @group(0) @binding(0) var<uniform> counts: vec4u;\n\
         @group(0) @binding(1) var<storage, read> records: array<f32>;\n\
         @group(0) @binding(2) var<storage, read_write> planes: array<f32>;\n",
    );
    for (binding, input) in (3..).zip(read) {
        let name = input.name();
        let _ = writeln!(
            wgsl,
            "@group(0) @binding({binding}) var<storage, read_write> {name}_tensor: array<f32>;"
        );
    }
    let _ = write!(
        wgsl,
        "\n@compute @workgroup_size({0})\nfn cs_main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {{\n\
         \x20   let i = id.x + id.y * workgroups.x * {0}u;\n    if (i >= counts.y) {{\n        return;\n    }}\n\
         \x20   let record = i / {LANES}u;\n    let lane = i % {LANES}u;\n    let sample = counts.x + i;\n",
        pass::WORKGROUP
    );
    let mut plane = 0;
    for (field, width) in adjoint.fixed() {
        for c in 0..width {
            let _ = writeln!(wgsl, "    planes[{plane}u * counts.z + sample] = {};", number(field, c));
            plane += 1;
        }
    }
    let share = places.weight.map_or_else(|| "1.0".to_owned(), |row| stored.number("record", row));
    let _ = writeln!(wgsl, "    planes[{plane}u * counts.z + sample] = {share};");
    for input in read {
        let (name, width) = (input.name(), input.width().unwrap_or(1));
        for c in 0..width {
            let _ = writeln!(wgsl, "    {name}_tensor[{width}u * sample + {c}u] = {};", number(name, c));
        }
    }
    wgsl.push_str("}\n");
    wgsl
}
