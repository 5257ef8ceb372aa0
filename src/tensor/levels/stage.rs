//! Passes over the atlas on the device, forwards.

use std::sync::Arc;

use burn::backend::Shape;
use burn::backend::wgpu::CubeTensor;
use wgpu::{BindingResource, Buffer, CommandEncoder, CommandEncoderDescriptor, ComputePipeline};

use super::backward::Adjoints;
use super::bound::{Lent, Pass, row_of, stored_texels, uniform};
use crate::adjoint::{AdjointError, plan_of};
use crate::buffer::{check_shape, lend};
use crate::gpu::GpuError;
use crate::gpu::engine::StoredAtlas;
use crate::inputs::{INPUTS, Input};
use crate::model::cube::Cube;
use crate::model::params::{Column, Param, Params};
use crate::operation::Operation;
use crate::pass;
use crate::samples::{Atlas, LANES};
use crate::shaded::{Scatter, Shaded};
use crate::shader::atlas::Level;
use crate::shader::atlas::buffers::{LevelShader, LevelShaders, Over};
use crate::shader::emit::Plan;
use crate::shader::search::components;
use crate::shader::tangent::chain::Chain;
use crate::stage::CUBES;
use crate::stage::resident::{Constants, Faces};
use crate::{SharedDevice, TensorError};

/// Levels on the device, and what makes them.
#[derive(Debug)]
pub(super) struct LevelStage {
    pub(super) shared: SharedDevice,
    pub(super) free: Free,
    /// The rules of samples and of texels.
    pub(super) plan: Plan,
    pub(super) atlas: Arc<Atlas>,
    pub(super) shaders: LevelShaders,
    passes: Vec<Pass>,
    pub(super) stored: StoredAtlas,
    pub(super) levels: Buffer,
    faces: [Option<Faces>; CUBES.len()],
    fill_faces: ComputePipeline,
    fill_records: ComputePipeline,
    take: ComputePipeline,
    adjoints: Adjoints,
}

/// What is free of the parameters, and where they start.
#[derive(Debug)]
pub(super) struct Free {
    params: Params,
    pub(super) columns: Vec<Column>,
}

/// What texels' records call the inputs that they hold.
pub(crate) const HELD: [(Input, &str); 4] = [
    (Input::Albedo, "albedo"),
    (Input::Specular, "specular"),
    (Input::Attenuator, "attenuator"),
    (Input::Open, "vertex_occlusion"),
];

impl LevelStage {
    pub(super) fn new(
        shared: &SharedDevice,
        shaded: &Shaded<'_>,
        cubes: [Option<&Cube<f32>>; CUBES.len()],
        atlas: Arc<Atlas>,
        scatter: Scatter,
    ) -> Result<Self, TensorError> {
        let gpu = shared.gpu();
        let turned = shaded.params.scalar(Param::EnvironmentRotation) != 0.0;
        let plan = plan_of(shaded.setup, shaded.columns, turned)?;
        if plan.passes.is_empty() || atlas.covered() == 0 {
            return Err(TensorError::no_atlas(shaded.setup.effects));
        }
        let shaders = {
            let row = row_of(&atlas);
            LevelShaders::new(&[(&plan, &Chain::default())], &stored_texels(&atlas, &row))
        };
        let what = "passes over an atlas that read textures other than cubes' faces";
        let remedy = "Leave the effects out that have such rules";
        let mut shaders = shaders.ok_or(TensorError::Levels { what, remedy })?;
        // Lookups are a matrix, whatever they find: nothing reads texels that are filled beyond the charts.
        shaders.shaders.retain(|shader| shader.over != Over::Empty);
        let free = Free { params: shaded.params.clone(), columns: shaded.columns.to_vec() };
        let bytes = 16 * u64::from(atlas.size()).pow(2) * shaders.layers.count as u64;
        let mut faces = [const { None }; CUBES.len()];
        let read = |input: Input| {
            let read =
                |shader: &LevelShader| input.faces().is_some_and(|of| shader.plan.resources.contains(&of));
            shaders.shaders.iter().any(read)
        };
        for (i, cube) in cubes.into_iter().enumerate() {
            if let Some(cube) = cube.filter(|_| read(CUBES[i])) {
                faces[i] = Some(Faces::new(gpu, cube.size())?);
            }
        }
        let made = |shader: &LevelShader| {
            let constants = Constants::new(gpu, &shader.plan.constants, shaded.params, shaded.columns)?;
            Pass::new(gpu, &shader.plan, (&shader.wgsl, &[]), constants)
        };
        let take = pass::module(gpu, "levels to tensors", include_str!("take.wgsl"))?;
        let records = pass::module(gpu, "tensors to texels", include_str!("records.wgsl"))?;
        Ok(Self {
            passes: shaders.shaders.iter().map(made).collect::<Result<_, _>>()?,
            levels: gpu.scratch("levels", bytes)?,
            stored: StoredAtlas::new(gpu, &atlas, false),
            fill_faces: Faces::filler(gpu)?,
            fill_records: pass::pipeline(gpu, &records, "cs_main")?,
            take: pass::pipeline(gpu, &take, "cs_levels")?,
            adjoints: Adjoints::new(gpu, scatter, &take)?,
            shared: shared.clone(),
            free,
            plan,
            atlas,
            shaders,
            faces,
        })
    }

    pub(super) fn texels(&self) -> usize {
        self.atlas.covered()
    }

    /// Texels of a level, covered or not.
    pub(super) fn places(&self) -> usize {
        (self.atlas.size() as usize).pow(2)
    }

    /// How many numbers of each texel samples look up.
    pub(super) fn numbers(&self) -> usize {
        self.plan.levels.iter().map(|level| components(level.kind)).sum()
    }

    /// What texels hold of an input, number by number within each; `None` where they do not.
    pub(super) fn held(&self, input: Input) -> Option<Vec<f32>> {
        let rows = &self.rows(input)?;
        let number = |texel: usize, row: Option<usize>| {
            row.map_or(0.0, |row| self.atlas.rows().record(texel / LANES)[row][texel % LANES])
        };
        let numbers = (0..self.texels()).flat_map(|texel| rows.iter().map(move |&row| number(texel, row)));
        Some(numbers.collect())
    }

    /// The rows of texels' records that hold an input's numbers, some of which nothing may read; `None` where nothing reads any.
    fn rows(&self, input: Input) -> Option<Vec<Option<usize>>> {
        let (_, name) = HELD.iter().find(|(held, _)| *held == input)?;
        let row = row_of(&self.atlas);
        let rows: Vec<_> = (0..input.width()?).map(|component| row(name, component)).collect();
        rows.iter().any(Option::is_some).then_some(rows)
    }

    /// What is shaded, at the values that its parameters start from.
    pub(super) fn constants(&self, plan: &Plan) -> Result<Option<Constants>, GpuError> {
        let Free { params, columns } = &self.free;
        Constants::new(self.shared.gpu(), &plan.constants, params, columns)
    }

    /// The buffers of the inputs that are read, by their place, `beside` them others, and room for results.
    pub(super) fn lend(
        &self,
        inputs: &[CubeTensor; INPUTS],
        beside: Vec<(&'static str, CubeTensor)>,
        results: &[Shape],
    ) -> Result<Lent, TensorError> {
        let read: Vec<Input> = Input::ALL.into_iter().filter(|&input| self.reads(input)).collect();
        let mut tensors = Vec::new();
        for &input in &read {
            let shape: Vec<usize> = self.shape(input).iter().copied().collect();
            check_shape(input.name(), &inputs[input as usize], &shape)?;
            tensors.push((input.name(), inputs[input as usize].clone()));
        }
        tensors.extend(beside);
        if tensors.is_empty() {
            // Burn's device is known by a tensor on it.
            tensors.push(("columns", inputs[0].clone()));
        }
        let (mut lent, made) = lend(self.shared.gpu(), tensors, results)?;
        let beside = lent.split_off(read.len().min(lent.len()));
        Ok(Lent { inputs: read.into_iter().zip(lent).collect(), beside, made })
    }

    /// Encode all passes, of the inputs as they are lent.
    pub(super) fn encode(&self, encoder: &mut CommandEncoder, lent: &Lent) {
        let gpu = self.shared.gpu();
        for (faces, cube) in self.faces.iter().zip(CUBES) {
            if let (Some(faces), Some(texels)) = (faces, lent.input(cube)) {
                faces.fill(gpu, encoder, &self.fill_faces, texels);
            }
        }
        for (input, _) in HELD {
            let (Some(rows), Some(given)) = (self.rows(input), lent.input(input)) else { continue };
            for (component, row) in rows.iter().enumerate() {
                let Some(row) = *row else { continue };
                let stride = self.atlas.rows().stride();
                let part = [self.texels(), rows.len(), component, row, stride].map(|number| number as u32);
                let part = uniform(gpu, &part);
                let bound = vec![
                    (0, part.as_entire_binding()),
                    (1, given.binding()),
                    (2, self.stored.records.as_entire_binding()),
                ];
                pass::dispatch(gpu, encoder, &self.fill_records, &[bound], self.texels() as u64);
            }
        }
        (0..self.passes.len()).for_each(|index| self.pass(encoder, lent, index));
    }

    /// Encode one of the passes forwards.
    pub(super) fn pass(&self, encoder: &mut CommandEncoder, lent: &Lent, index: usize) {
        let (shader, pass) = (&self.shaders.shaders[index], &self.passes[index]);
        let (list, workgroups) = self.stored.list(shader.over);
        if workgroups > 0 {
            let threads = u64::from(workgroups) * u64::from(pass::WORKGROUP);
            self.run(encoder, lent, (pass, &shader.plan), (list, &[]), threads);
        }
    }

    /// Encode a pass over the atlas: `list` is what a blur's threads take, `beside` what is bound after it.
    pub(super) fn run(
        &self,
        encoder: &mut CommandEncoder,
        lent: &Lent,
        (pass, plan): (&Pass, &Plan),
        (list, beside): (&Buffer, &[BindingResource<'_>]),
        threads: u64,
    ) {
        let gpu = self.shared.gpu();
        let mut lights = Vec::new();
        if let Some(constants) = &pass.constants {
            constants.fill(gpu, encoder, lent.input(Input::Columns));
            lights.push((0, constants.block.as_entire_binding()));
        }
        for (i, read) in (1..).zip(&plan.resources) {
            let place = CUBES.iter().position(|cube| cube.faces() == Some(*read));
            let faces = place.and_then(|place| self.faces[place].as_ref());
            lights.extend(faces.map(|faces| (i, BindingResource::TextureView(&faces.view))));
        }
        let StoredAtlas { texels, records, .. } = &self.stored;
        let own = [&self.levels, texels, records, list].map(Buffer::as_entire_binding);
        let own = own.into_iter().chain(beside.iter().cloned());
        pass::dispatch(gpu, encoder, &pass.pipeline, &[lights, (0..).zip(own).collect()], threads);
    }

    /// Where the levels that samples look up begin, in texels, how many numbers each has, and which of a texel's is its first.
    pub(super) fn looked_up(&self, place: impl Fn(&str) -> Option<usize>) -> Vec<Option<[usize; 3]>> {
        let mut first = 0;
        let of = |level: &Level| {
            let numbers = components(level.kind);
            first += numbers;
            Some([place(&level.name)? * self.places(), numbers, first - numbers])
        };
        self.plan.levels.iter().map(of).collect()
    }

    /// The counts of a pass that takes a level to a tensor, or back.
    pub(super) fn taken(&self, [first, numbers, level]: [usize; 3]) -> Buffer {
        let part = [self.texels(), self.numbers(), first, numbers, level].map(|number| number as u32);
        uniform(self.shared.gpu(), &part)
    }

    pub(super) fn encoder(&self, label: &str) -> CommandEncoder {
        self.shared.gpu().device.create_command_encoder(&CommandEncoderDescriptor { label: Some(label) })
    }

    pub(super) fn submit(&self, encoder: CommandEncoder) -> Result<(), GpuError> {
        let gpu = self.shared.gpu();
        gpu.queue.submit([encoder.finish()]);
        gpu.check()
    }
}

impl Operation for LevelStage {
    fn shared(&self) -> &SharedDevice {
        &self.shared
    }

    fn reads(&self, input: Input) -> bool {
        match CUBES.iter().position(|&cube| cube == input) {
            Some(cube) => self.faces[cube].is_some(),
            None if input == Input::Columns => !self.free.columns.is_empty(),
            None => self.rows(input).is_some(),
        }
    }

    fn check(&self, tracked: &[Input]) -> Result<(), TensorError> {
        let read: Vec<Input> = tracked.iter().copied().filter(|&input| self.reads(input)).collect();
        match read.iter().find(|input| input.faces().is_some()) {
            Some(cube) => Err(AdjointError::CubeOfTexels { cube: cube.name() }.into()),
            None => self.adjoints.check(self, &read),
        }
    }

    fn shape(&self, input: Input) -> Shape {
        match (input.width(), CUBES.iter().position(|&cube| cube == input)) {
            (Some(width), _) => Shape::new([self.texels(), width]),
            (_, Some(i)) => Shape::new([self.faces[i].as_ref().map_or(0, Faces::texels), 4]),
            _ => Shape::new([self.free.columns.len()]),
        }
    }

    fn forward(&self, inputs: &[CubeTensor; INPUTS]) -> Result<CubeTensor, TensorError> {
        let gpu = self.shared.gpu();
        let lent = self.lend(inputs, Vec::new(), &[Shape::new([self.texels(), self.numbers()])])?;
        let mut encoder = self.encoder("levels");
        self.encode(&mut encoder, &lent);
        for [level, numbers, first] in
            self.looked_up(|name| self.shaders.layers.place(name)).into_iter().flatten()
        {
            let part = self.taken([first, numbers, level]);
            let bound = vec![
                (0, part.as_entire_binding()),
                (1, self.stored.texels.as_entire_binding()),
                (2, self.levels.as_entire_binding()),
                (4, lent.made[0].binding()),
            ];
            pass::dispatch(gpu, &mut encoder, &self.take, &[bound], self.texels() as u64);
        }
        self.submit(encoder)?;
        let mut made = lent.made;
        Ok(made.remove(0).into_tensor())
    }

    fn backward(
        &self,
        inputs: &[CubeTensor; INPUTS],
        adjoint: CubeTensor,
        wanted: &[Input],
    ) -> Result<Vec<CubeTensor>, TensorError> {
        check_shape("the levels' adjoint", &adjoint, &[self.texels(), self.numbers()])?;
        self.adjoints.run(self, inputs, &adjoint, wanted)
    }
}
