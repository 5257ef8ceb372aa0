//! The shading operation on the device: the passes forwards and backwards; `resident`: what stays there from one to
//! the next.

pub(super) mod resident;

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use burn::backend::Shape;
use burn::backend::wgpu::CubeTensor;
use wgpu::{
    BindingResource, Buffer, BufferUsages, CommandEncoder, CommandEncoderDescriptor, ComputePipeline,
};

use self::resident::{Constants, Faces, fixed_planes, group_starts};
use super::buffer::{TensorBuffer, check_shape, lend};
use super::drawn::Planes;
use super::inputs::{INPUTS, Input};
use super::operation::Operation;
use super::row_sums::RowSums;
use super::scatter::Scattering;
use super::shaded::{Scatter, Shaded};
use super::{SharedDevice, TensorError, pass};
use crate::adjoint::{Adjoint, Binding, Module};
use crate::gpu::engine::DeviceSamples;
use crate::gpu::{Gpu, GpuError};
use crate::model::cube::Cube;
use crate::model::params::Param;
use crate::samples::{LANES, ViewSamples};

/// The operation's part on the device.
#[derive(Debug)]
pub(super) struct Stage {
    pub(super) shared: SharedDevice,
    pub(super) adjoint: Adjoint,
    pub(super) slots: usize,
    pub(super) samples: usize,
    part: Buffer,
    fixed: Buffer,
    group_start: Buffer,
    constants: Option<Constants>,
    /// The cubes' faces, in the order of irradiance, lobe and hilite.
    faces: [Option<Faces>; CUBES.len()],
    fill_faces: ComputePipeline,
    forward: Compiled,
    /// By what is wanted.
    backward: Mutex<HashMap<Vec<Input>, Compiled>>,
    scattering: Scattering,
    sums: RowSums,
}

#[derive(Clone, Debug)]
struct Compiled {
    pipeline: ComputePipeline,
    bindings: Vec<Binding>,
}

pub(super) const CUBES: [Input; 5] =
    [Input::Irradiance, Input::Lobe, Input::Hilite, Input::Reflected, Input::Glossy];

/// Where an input stands in [`Input::ALL`].
const fn at(input: Input) -> usize {
    input as usize
}

impl Stage {
    pub(super) fn new(
        shared: &SharedDevice,
        shaded: &Shaded<'_>,
        cubes: [Option<&Cube<f32>>; CUBES.len()],
        views: &[&ViewSamples],
        made: Option<&DeviceSamples>,
        scatter: Scatter,
    ) -> Result<(Self, Option<Planes>), TensorError> {
        let gpu = shared.gpu();
        let turned = shaded.params.scalar(Param::EnvironmentRotation) != 0.0;
        let adjoint = Adjoint::new(shaded.setup, shaded.columns, turned)?;
        if made.is_none() && views.iter().any(|view| view.surface.slots() != view.records() * LANES) {
            let reason = "the views hold groups without a surface".to_owned();
            return Err(TensorError::Foreign { what: "the samples", reason });
        }
        let drawn = made.map(|made| Planes::draw(shared, &adjoint, made, views)).transpose()?;
        let fixed = match &drawn {
            Some(drawn) => drawn.fixed.clone(),
            None => gpu.storage("samples", bytemuck::cast_slice(&fixed_planes(&adjoint, views)))?,
        };
        let slots = views.iter().map(|view| view.pixel.len()).sum();
        let samples = views.iter().map(|view| view.records() * LANES).sum();
        let mut faces = [const { None }; CUBES.len()];
        for (i, cube) in cubes.into_iter().enumerate() {
            if let Some(cube) = cube.filter(|_| adjoint.reads(CUBES[i])) {
                faces[i] = Some(Faces::new(gpu, cube.size())?);
            }
        }
        let stage = Self {
            part: gpu.buffer(
                "part",
                bytemuck::cast_slice(&[slots as u32, samples as u32]),
                BufferUsages::UNIFORM,
            ),
            fixed,
            group_start: gpu.storage("groups", bytemuck::cast_slice(&group_starts(views)))?,
            constants: Constants::new(gpu, &adjoint.plan.constants, shaded.params, shaded.columns)?,
            faces,
            fill_faces: Faces::filler(gpu)?,
            forward: Compiled::new(gpu, &adjoint.forward())?,
            backward: Mutex::default(),
            scattering: Scattering::new(gpu, scatter)?,
            sums: RowSums::new(gpu)?,
            shared: shared.clone(),
            adjoint,
            slots,
            samples,
        };
        Ok((stage, drawn))
    }

    /// The shape of an input's tensor.
    fn shape_of(&self, input: Input) -> Shape {
        match (self.adjoint.width(input), CUBES.iter().position(|&cube| cube == input)) {
            (Some(width), _) => Shape::new([self.samples, width]),
            (_, Some(i)) => Shape::new([self.faces[i].as_ref().map_or(0, Faces::texels), 4]),
            _ => Shape::new([self.adjoint.columns.len()]),
        }
    }

    /// The inputs' buffers by their place (the image's adjoint last), and room for results.
    #[allow(clippy::type_complexity, reason = "the two lists of `lend`, the first by place")]
    fn lend(
        &self,
        inputs: &[CubeTensor; INPUTS],
        adjoint: Option<CubeTensor>,
        results: &[Shape],
    ) -> Result<(HashMap<usize, TensorBuffer>, Vec<TensorBuffer>), TensorError> {
        let mut places = Vec::new();
        let mut tensors = Vec::new();
        for input in Input::ALL.into_iter().filter(|&input| self.adjoint.reads(input)) {
            let shape: Vec<usize> = self.shape_of(input).iter().copied().collect();
            check_shape(input.name(), &inputs[at(input)], &shape)?;
            places.push(at(input));
            tensors.push((input.name(), inputs[at(input)].clone()));
        }
        if let Some(adjoint) = adjoint {
            places.push(Input::ALL.len());
            tensors.push(("the image's adjoint", adjoint));
        }
        if tensors.is_empty() {
            // Burn's device is known by a tensor on it.
            places.push(usize::MAX);
            tensors.push(("columns", inputs[0].clone()));
        }
        let (lent, made) = lend(self.shared.gpu(), tensors, results)?;
        Ok((places.into_iter().zip(lent).collect(), made))
    }

    fn encoder(&self, label: &str) -> CommandEncoder {
        self.shared.gpu().device.create_command_encoder(&CommandEncoderDescriptor { label: Some(label) })
    }

    fn submit(&self, encoder: CommandEncoder) -> Result<(), GpuError> {
        let gpu = self.shared.gpu();
        gpu.queue.submit([encoder.finish()]);
        gpu.check()
    }

    /// A buffer of `numbers` numbers, for one submission.
    fn room(&self, numbers: usize) -> Result<Buffer, GpuError> {
        let gpu = self.shared.gpu();
        gpu.scratch("what is kept for the backward pass", 4 * numbers.max(1) as u64)
    }

    /// Take constants and cubes from the tensors to where shaders read them.
    fn fill(&self, encoder: &mut CommandEncoder, lent: &HashMap<usize, TensorBuffer>) {
        let gpu = self.shared.gpu();
        if let Some(constants) = &self.constants {
            constants.fill(
                gpu,
                encoder,
                lent.get(&at(Input::Columns)).filter(|_| !self.adjoint.columns.is_empty()),
            );
        }
        for (faces, cube) in self.faces.iter().zip(CUBES) {
            if let (Some(faces), Some(texels)) = (faces, lent.get(&at(cube))) {
                faces.fill(gpu, encoder, &self.fill_faces, texels);
            }
        }
    }

    /// What is bound, but for what a pass writes.
    fn resource<'a>(
        &'a self,
        binding: Binding,
        lent: &'a HashMap<usize, TensorBuffer>,
    ) -> BindingResource<'a> {
        match binding {
            Binding::Fixed => self.fixed.as_entire_binding(),
            Binding::GroupStart => self.group_start.as_entire_binding(),
            Binding::Given(input) => lent[&at(input)].binding(),
            Binding::ImageAdjoint => lent[&Input::ALL.len()].binding(),
            _ => self.part.as_entire_binding(),
        }
    }

    fn dispatch<'a>(
        &'a self,
        encoder: &mut CommandEncoder,
        compiled: &Compiled,
        resource: &dyn Fn(Binding) -> BindingResource<'a>,
    ) {
        let mut planned: Vec<(u32, BindingResource<'a>)> = Vec::new();
        planned.extend(self.constants.as_ref().map(|constants| (0, constants.block.as_entire_binding())));
        for (i, read) in self.adjoint.plan.resources.iter().enumerate() {
            let faces = CUBES
                .iter()
                .position(|cube| cube.faces() == Some(*read))
                .and_then(|k| self.faces[k].as_ref());
            planned.extend(faces.map(|faces| (1 + i as u32, BindingResource::TextureView(&faces.view))));
        }
        let bound =
            compiled.bindings.iter().enumerate().map(|(i, &binding)| (i as u32, resource(binding))).collect();
        pass::dispatch(self.shared.gpu(), encoder, &compiled.pipeline, &[planned, bound], self.slots as u64);
    }

    /// What is wanted, in parts that a shader has bindings enough for.
    fn parts(&self, wanted: &[Input]) -> Result<Vec<Vec<Input>>, TensorError> {
        let limit = self.shared.gpu().device.limits().max_storage_buffers_per_shader_stage as usize;
        // All of them but the uniform one.
        let takes = |part: &[Input]| Ok::<_, TensorError>(self.adjoint.backward(part)?.bindings.len() - 1);
        let mut parts: Vec<Vec<Input>> = Vec::new();
        for &input in wanted {
            match parts.last_mut() {
                Some(last) if takes(&[last.as_slice(), &[input]].concat())? <= limit => last.push(input),
                _ => parts.push(vec![input]),
            }
        }
        Ok(parts)
    }

    fn compiled(&self, wanted: &[Input]) -> Result<Compiled, TensorError> {
        let mut known = self.backward.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(compiled) = known.get(wanted) {
            return Ok(compiled.clone());
        }
        let compiled = Compiled::new(self.shared.gpu(), &self.adjoint.backward(wanted)?)?;
        known.insert(wanted.to_vec(), compiled.clone());
        Ok(compiled)
    }
}

impl Operation for Stage {
    fn shared(&self) -> &SharedDevice {
        &self.shared
    }

    fn reads(&self, input: Input) -> bool {
        self.adjoint.reads(input)
    }

    fn check(&self, tracked: &[Input]) -> Result<(), TensorError> {
        Ok(tracked.iter().try_for_each(|&input| self.adjoint.moves(input))?)
    }

    fn shape(&self, input: Input) -> Shape {
        self.shape_of(input)
    }

    /// The image of those inputs.
    fn forward(&self, inputs: &[CubeTensor; INPUTS]) -> Result<CubeTensor, TensorError> {
        let (lent, mut made) = self.lend(inputs, None, &[Shape::new([self.slots, 4])])?;
        let image = made.remove(0);
        let mut encoder = self.encoder("shade");
        self.fill(&mut encoder, &lent);
        let resource = |binding: Binding| match binding {
            Binding::Image => image.binding(),
            other => self.resource(other, &lent),
        };
        self.dispatch(&mut encoder, &self.forward, &resource);
        self.submit(encoder)?;
        Ok(image.into_tensor())
    }

    fn backward(
        &self,
        inputs: &[CubeTensor; INPUTS],
        adjoint: CubeTensor,
        wanted: &[Input],
    ) -> Result<Vec<CubeTensor>, TensorError> {
        check_shape("the image's adjoint", &adjoint, &[self.slots, 4])?;
        let shapes: Vec<Shape> = wanted.iter().map(|&input| self.shape_of(input)).collect();
        let (lent, made) = self.lend(inputs, Some(adjoint), &shapes)?;
        let mut encoder = self.encoder("adjoint of shading");
        self.fill(&mut encoder, &lent);
        for part in self.parts(wanted)? {
            let compiled = self.compiled(&part)?;
            let mut scratch = HashMap::new();
            for &binding in &compiled.bindings {
                let numbers = match binding {
                    Binding::PartialSums => {
                        pass::workgroup_count(self.slots as u64) as usize * self.adjoint.columns.len()
                    }
                    Binding::LightAdjoint(_) => 4 * self.samples,
                    Binding::LightPlace(_) => 3 * self.samples,
                    _ => continue,
                };
                scratch.insert(binding, self.room(numbers)?);
            }
            let gradient = |input: Input| &made[wanted.iter().position(|&w| w == input).unwrap_or(0)];
            let resource = |binding: Binding| match binding {
                Binding::Gradient(input) => gradient(input).binding(),
                other => {
                    scratch.get(&other).map_or_else(|| self.resource(other, &lent), Buffer::as_entire_binding)
                }
            };
            self.dispatch(&mut encoder, &compiled, &resource);
            if part.contains(&Input::Columns) {
                let rows = pass::workgroup_count(self.slots as u64) as usize;
                let partial = &scratch[&Binding::PartialSums];
                let (gpu, columns) = (self.shared.gpu(), self.adjoint.columns.len());
                self.sums.add_up(gpu, &mut encoder, partial, (rows, columns), gradient(Input::Columns))?;
            }
            for &cube in part.iter().filter(|input| input.faces().is_some()) {
                let size =
                    self.faces[at(cube) - at(Input::Irradiance)].as_ref().map_or(0, |faces| faces.size);
                let lookups = self.adjoint.lookups(cube);
                let lights: Vec<[&Buffer; 2]> = lookups
                    .map(|(i, _)| [&scratch[&Binding::LightAdjoint(i)], &scratch[&Binding::LightPlace(i)]])
                    .collect();
                self.scattering.encode(
                    self.shared.gpu(),
                    &mut encoder,
                    &lights,
                    self.samples,
                    size,
                    gradient(cube),
                )?;
            }
        }
        self.submit(encoder)?;
        Ok(made.into_iter().map(TensorBuffer::into_tensor).collect())
    }
}

impl Compiled {
    fn new(gpu: &Gpu, module: &Module) -> Result<Self, GpuError> {
        let pipeline = pass::pipeline(gpu, &pass::module(gpu, "shade", &module.wgsl)?, "cs_main")?;
        Ok(Self { pipeline, bindings: module.bindings.clone() })
    }
}
