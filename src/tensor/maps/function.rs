//! Images, and the loss of all of them, as functions of constants and whole maps, with gradients: lists of numbers in and
//! out, for solvers that know nothing of burn's tensors.

use super::evaluate::{Variables, input_of};
use super::layer::{Grid, Layer};
use super::layers::layers;
use super::parts::{cuts_of_one_view, most_samples, shades};
use super::pixels::{Part, View};
use super::problem::read;
use super::{MapError, MapTask};
use crate::adjoint::AdjointError;
use crate::bake::stacks::Stack;
use crate::engine::residual::Residuals;
use crate::engine::{Point, Unknown};
use crate::model::params::{Column, Param};
use crate::samples::ViewSamples;
use crate::scene::MapKind;
use crate::{Input, Shaded, SharedDevice, TensorError};

/// The images of some views, and their loss, as functions of constants and maps: on an adapter, in 32 bits.
///
/// Constants are a [`Point`]; of it count the gains, and what the task has free. Maps are lists of numbers in the order of
/// [`maps`](Self::maps), each row by row with its channels together; `None` stands for a map as it is at the start.
/// Bakes and samples stay as they are.
pub struct MapFunction {
    variables: Variables,
    /// Of one view each.
    parts: Vec<Part>,
    views: Vec<View>,
    residuals: Residuals,
    /// What the loss is a mean over.
    weight: f64,
    unknowns: Vec<Unknown>,
}

/// A map, as a function takes it.
#[derive(Clone, Debug, PartialEq)]
pub struct MapInfo {
    /// `color`, `specular`, `attenuator`, `occlusion`, `irradiance`, `lobe` or `hilite`.
    pub name: &'static str,
    /// Rows, columns and, of colours, 3; or vertices; or 6 faces, rows, columns and 4, the last of which is a luminance.
    pub shape: Vec<usize>,
    /// Least and greatest value that a fit allows.
    pub bounds: (f64, f64),
}

/// A gradient.
#[derive(Clone, Debug, PartialEq)]
pub struct MapGradients {
    /// By the task's unknowns, in their order.
    pub constants: Vec<f64>,
    /// By each map's numbers.
    pub maps: Vec<Vec<f32>>,
}

/// Maps that are given, in the order of [`MapFunction::maps`]; the start's for those that are not.
pub type GivenMaps = Vec<Option<Vec<f32>>>;

impl MapFunction {
    /// Of the task's maps and of what it has free. The loss is that of the scene's fit, without priors.
    ///
    /// # Errors
    /// When no effect reads a map, a constant is free that acts through a cube which is a map itself, or the device does not
    /// take it.
    pub fn new(shared: &SharedDevice, task: MapTask<'_>) -> Result<Self, MapError> {
        task.check()?;
        let setup = task.scene.setup();
        let free = || task.unknowns.iter().filter_map(Unknown::column);
        // The exponent moves a cube alone, which is an input of its own.
        let columns: Vec<Column> = free().filter(|column| column.param != Param::SpecularLobe).collect();
        let samples: Vec<&ViewSamples> = task.observed.iter().map(|view| &view.samples).collect();
        let most = task.most_samples.unwrap_or_else(|| most_samples(shared, setup.needs().fields));
        let mut cuts = cuts_of_one_view(&samples, most);
        // Without any sample there is a part of no view.
        cuts.retain(|cut| cut.one_view().is_some());
        let params = &task.start.params;
        let shaded = Shaded { setup, params, columns: &columns, illumination: &task.illumination };
        let shades = shades(shared, &shaded, &samples, &cuts)?;
        let reads = |input: Input| shades.iter().all(|(shade, _)| shade.reads(input));
        let levels = shades.iter().find_map(|(shade, _)| shade.levels()).cloned();
        let exponent = params.scalar(Param::SpecularLobe);
        let layers =
            layers(shared, &task, &cuts, &reads, (exponent, levels.as_ref().map(|(levels, _)| levels)))?;
        let moves = |stack: &Stack| {
            let paces = stack.paces(params);
            free().any(|column| paces.iter().any(|(name, _)| *name == column.param.name()))
        };
        let in_texels =
            |stack: &&Stack| levels.as_ref().is_some_and(|(levels, _)| levels.reads(input_of(**stack)));
        if let Some(stack) = Stack::ALL.iter().filter(|stack| moves(stack)).find(in_texels) {
            let cube = input_of(*stack).name();
            return Err(TensorError::from(AdjointError::CubeOfTexels { cube }).into());
        }
        let baked = |stack: &Stack| stack.at(&task.illumination, stack.place(params)).is_some();
        let chosen = |stack: &Stack| reads(input_of(*stack)) && moves(stack) && baked(stack);
        let stacks = Stack::ALL.into_iter().filter(chosen).collect();
        let parts = cuts.iter().zip(shades).filter_map(|(cut, shade)| Part::new(cut, shade)).collect();
        let cameras = task.scene.views.iter().map(|view| &view.camera);
        let pixels = cameras.map(|camera| camera.width as usize * camera.height as usize);
        let observed = task.observed.into_iter().zip(pixels).enumerate();
        let views: Vec<View> = observed
            .map(|(i, (observed, pixels))| View::new(observed, pixels, task.held_out != Some(i)))
            .collect();
        Ok(Self {
            variables: Variables {
                shared: shared.clone(),
                layers,
                columns,
                stacks,
                illumination: task.illumination,
                levels,
            },
            parts,
            weight: views.iter().map(View::weight).sum::<f64>().max(f64::MIN_POSITIVE),
            views,
            residuals: Residuals::new(task.scene.fit.loss),
            unknowns: task.unknowns,
        })
    }

    /// The adapter's name.
    #[must_use]
    pub fn adapter(&self) -> &str {
        self.variables.shared.gpu().name()
    }

    /// The maps, in the order of every list of them.
    #[must_use]
    pub fn maps(&self) -> Vec<MapInfo> {
        self.variables.layers.iter().map(MapInfo::of).collect()
    }

    /// Each map's numbers at the start.
    ///
    /// # Errors
    /// When the device does not give them.
    pub fn start(&self) -> Result<Vec<Vec<f32>>, MapError> {
        let layers = self.variables.layers.iter();
        Ok(layers.map(|layer| read(layer.start.clone())).collect::<Result<_, _>>()?)
    }

    /// A view's image, three numbers a pixel, row by row: linear Rec.709 radiance, premultiplied by the coverage, times the
    /// view's gain; 0 where no skin is seen.
    ///
    /// # Errors
    /// When there is no such view, a map has another length, or the device fails.
    pub fn image(&self, view: usize, point: &Point, maps: GivenMaps) -> Result<Vec<f32>, MapError> {
        let own = self.view(view)?;
        let at = self.variables.at(point, self.views.len(), maps)?;
        let (gain, mut image) = (at.gain(view), vec![0.0; 3 * own.pixels]);
        for (index, part) in self.parts_of(view) {
            let numbers = at.image(index, part)?;
            for seen in own.seen(part) {
                for c in 0..3 {
                    let radiance = f64::from(numbers[4 * seen.slot + c]);
                    image[3 * seen.pixel + c] = (seen.coverage * gain.channel(c) * radiance) as f32;
                }
            }
        }
        self.variables.shared.gpu().check().map_err(TensorError::from)?;
        Ok(image)
    }

    /// The gradient of the inner product of a view's image and `adjoint`, three numbers a pixel.
    ///
    /// # Errors
    /// As [`image`](Self::image), and when the adjoint has another length.
    pub fn vjp(
        &self,
        view: usize,
        point: &Point,
        maps: GivenMaps,
        adjoint: &[f32],
    ) -> Result<MapGradients, MapError> {
        let own = self.view(view)?;
        MapError::check_length("the image's adjoint", adjoint.len(), 3 * own.pixels)?;
        let mut at = self.variables.at(point, self.views.len(), maps)?;
        for (index, part) in self.parts_of(view) {
            at.pull(index, part, |_| {
                let mut slopes = vec![[0.0; 4]; part.slots.len()];
                for seen in own.seen(part) {
                    let pixel = &adjoint[3 * seen.pixel..];
                    (0..3).for_each(|c| slopes[seen.slot][c] = seen.coverage * f64::from(pixel[c]));
                }
                slopes
            })?;
        }
        Ok(at.gradients(&self.unknowns)?)
    }

    /// The loss: the mean of the weighted losses over pixels and channels of all views that count.
    ///
    /// # Errors
    /// When a map has another length, or the device fails.
    pub fn loss(&self, point: &Point, maps: GivenMaps) -> Result<f64, MapError> {
        let at = self.variables.at(point, self.views.len(), maps)?;
        let mut loss = 0.0;
        for (index, part, view) in self.counting() {
            let image = at.image(index, part)?;
            loss += view.weigh(part, self.residuals, &image, at.gain(part.view)).0;
        }
        self.variables.shared.gpu().check().map_err(TensorError::from)?;
        Ok(loss / self.weight)
    }

    /// The loss and its gradient, in one pass forwards and one backwards.
    ///
    /// # Errors
    /// As [`loss`](Self::loss).
    pub fn loss_and_gradient(&self, point: &Point, maps: GivenMaps) -> Result<(f64, MapGradients), MapError> {
        let mut at = self.variables.at(point, self.views.len(), maps)?;
        let mut loss = 0.0;
        for (index, part, view) in self.counting() {
            let gain = at.gain(part.view);
            at.pull(index, part, |image| {
                let (of_part, mut slopes) = view.weigh(part, self.residuals, image, gain);
                loss += of_part;
                slopes.iter_mut().flatten().for_each(|slope| *slope /= self.weight);
                slopes
            })?;
        }
        Ok((loss / self.weight, at.gradients(&self.unknowns)?))
    }

    fn view(&self, view: usize) -> Result<&View, MapError> {
        self.views.get(view).ok_or(MapError::NoView { view, views: self.views.len() })
    }

    /// The parts of a view, by their numbers.
    fn parts_of(&self, view: usize) -> impl Iterator<Item = (usize, &Part)> {
        self.parts.iter().enumerate().filter(move |(_, part)| part.view == view)
    }

    /// The parts of the views that count, by their numbers.
    fn counting(&self) -> impl Iterator<Item = (usize, &Part, &View)> {
        let parts = self.parts.iter().enumerate();
        parts.map(|(index, part)| (index, part, &self.views[part.view])).filter(|(.., view)| view.counts)
    }
}

/// Whether a constant acts through a cube that is itself a map of these kinds.
#[must_use]
pub fn acts_through_cubes(param: Param, kinds: &[MapKind]) -> bool {
    param == Param::SpecularLobe && kinds.contains(&MapKind::Environment)
}

impl MapInfo {
    fn of(layer: &Layer) -> Self {
        let [_, channels] = layer.start.dims();
        let mut shape = match layer.grid {
            Grid::Texels { width, height } => vec![height, width],
            Grid::Vertices(count) => vec![count],
            Grid::Cube(size) => vec![6, size, size],
        };
        shape.extend((channels > 1).then_some(channels));
        Self { name: layer.name, shape, bounds: (layer.prior.lower, layer.prior.upper) }
    }
}
