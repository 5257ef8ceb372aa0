//! A map as an unknown: its texels, how samples see them, and what is held of them beforehand.

use burn::tensor::{Tensor, TensorData};

use super::parts::Cut;
use crate::scene::MapPrior;
use crate::sparse::Entries;
use crate::{Input, Inputs, SharedDevice, Sparse, TensorError};

/// How a layer's texels lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grid {
    /// Row by row.
    Texels {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// One a vertex of the mesh.
    Vertices(usize),
    /// Six faces with this number of texels a side, row by row.
    Cube(usize),
}

/// One map, on the device.
#[derive(Clone, Debug)]
pub struct Layer {
    /// What it is in messages and file names.
    pub name: &'static str,
    /// Which input of the shading operation it is.
    pub input: Input,
    /// How its texels lie.
    pub grid: Grid,
    /// From texels to the input, a matrix for each part of the samples; a cube's are all the same.
    pub footprints: Vec<Sparse>,
    /// From texels to those of the UV atlas, where what is computed there reads the input.
    pub in_atlas: Option<Sparse>,
    /// From texels to the differences of neighbours.
    pub differences: Sparse,
    /// Of each texel, how many neighbours it has: \[texels, 1\].
    pub neighbours: Tensor<2>,
    /// Where the fit starts: \[texels, channels\].
    pub start: Tensor<2>,
    /// Where it is.
    pub value: Tensor<2>,
    /// What is held of it beforehand.
    pub prior: MapPrior,
}

/// What a layer is made of.
#[derive(Clone, Debug)]
pub struct LayerParts {
    /// What it is in messages and file names.
    pub name: &'static str,
    /// Which input of the shading operation it is.
    pub input: Input,
    /// How its texels lie.
    pub grid: Grid,
    /// From texels to the input.
    pub footprint: Entries,
    /// From texels to those of the UV atlas, where what is computed there reads the input.
    pub in_atlas: Option<Entries>,
    /// Neighbouring texels, each pair once.
    pub pairs: Vec<[u32; 2]>,
    /// The texels' numbers at the start, channel by channel within each.
    pub start: Vec<f32>,
    /// What is held of it beforehand.
    pub prior: MapPrior,
}

impl Layer {
    /// A layer on the device, of samples that are cut so.
    ///
    /// # Errors
    /// When the device does not take it.
    pub fn new(shared: &SharedDevice, parts: LayerParts, cuts: &[Cut]) -> Result<Self, TensorError> {
        let texels = parts.footprint.columns;
        let channels = parts.start.len() / texels.max(1);
        let mut neighbours = vec![0.0_f32; texels];
        parts.pairs.iter().flatten().for_each(|&texel| neighbours[texel as usize] += 1.0);
        let differences = crate::footprint::differences(texels, parts.pairs);
        let bytes = 4 * (differences.rows() * channels) as u64;
        shared.gpu().check_binding("differences between neighbouring texels", bytes)?;
        let matrix = |numbers: Vec<f32>, columns: usize| {
            Tensor::<2>::from_data(TensorData::new(numbers, [texels, columns]), shared.device())
        };
        let start = matrix(parts.start, channels);
        Ok(Self {
            name: parts.name,
            input: parts.input,
            grid: parts.grid,
            in_atlas: parts.in_atlas.map(|entries| Sparse::new(shared, &entries)).transpose()?,
            footprints: footprints(shared, parts.grid, &parts.footprint, cuts)?,
            differences: Sparse::new(shared, &differences)?,
            neighbours: matrix(neighbours, 1),
            value: start.clone(),
            start,
            prior: parts.prior,
        })
    }

    /// How many numbers it has.
    #[must_use]
    pub fn numbers(&self) -> usize {
        let [texels, channels] = self.start.dims();
        texels * channels
    }

    /// Put what `texels` show to a part of the samples in the place of its input.
    ///
    /// # Errors
    /// When the device does not take it.
    pub fn show(&self, part: usize, texels: Tensor<2>, inputs: &mut Inputs) -> Result<(), TensorError> {
        *slot(self.input, inputs) = self.footprints[part].apply(texels)?;
        Ok(())
    }

    /// Put what `texels` show to those of the UV atlas in the place of their input; nothing where what is computed there does
    /// not read it.
    ///
    /// # Errors
    /// When the device does not take it.
    pub fn show_atlas(&self, texels: Tensor<2>, inputs: &mut Inputs) -> Result<(), TensorError> {
        if let Some(in_atlas) = &self.in_atlas {
            *slot(self.input, inputs) = in_atlas.apply(texels)?;
        }
        Ok(())
    }

    /// What the priors say against `texels`: \[1\].
    ///
    /// # Errors
    /// When the device does not take it.
    pub fn penalty(&self, texels: Tensor<2>) -> Result<Tensor<1>, TensorError> {
        let start = if texels.is_autodiff() { self.start.clone().autodiff() } else { self.start.clone() };
        let change = texels - start;
        let close = change.clone().square().sum() * (self.prior.closeness / self.numbers() as f64);
        if self.prior.smoothness == 0.0 {
            return Ok(close);
        }
        let rough = self.differences.apply(change)?.square().sum();
        Ok(close + rough * self.roughness())
    }

    /// The weight of a squared difference of neighbours.
    #[must_use]
    pub fn roughness(&self) -> f64 {
        let [_, channels] = self.start.dims();
        self.prior.smoothness / (self.differences.rows() * channels).max(1) as f64
    }
}

fn footprints(
    shared: &SharedDevice,
    grid: Grid,
    entries: &Entries,
    cuts: &[Cut],
) -> Result<Vec<Sparse>, TensorError> {
    if cuts.len() == 1 || matches!(grid, Grid::Cube(_)) {
        return Ok(vec![Sparse::new(shared, entries)?; cuts.len()]);
    }
    cuts.iter().map(|cut| Sparse::new(shared, &entries.part(cut.samples.clone()))).collect()
}

/// The tensor of an input that is a matrix.
pub(super) fn slot(input: Input, inputs: &mut Inputs) -> &mut Tensor<2> {
    match input {
        Input::Albedo => &mut inputs.albedo,
        Input::Specular => &mut inputs.specular,
        Input::Attenuator => &mut inputs.attenuator,
        Input::Open => &mut inputs.open,
        Input::Irradiance => &mut inputs.irradiance,
        Input::Lobe => &mut inputs.lobe,
        Input::Hilite => &mut inputs.hilite,
        Input::Reflected => &mut inputs.reflected,
        Input::Glossy => &mut inputs.glossy,
        // Columns and levels are no maps.
        Input::Bump | Input::Columns | Input::Levels => &mut inputs.bump,
    }
}
