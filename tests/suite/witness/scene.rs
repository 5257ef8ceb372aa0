//! Pixels, views, and what a fit asks of them: loss, gradient and normal equations, all by central differences.

use super::fragment::{Constants, Form, Lights, Silhouette, Surface, Variant, shade};
use super::losses::Loss;

/// A sample of a pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    /// Its share of the pixel; a pixel's shares add up to 1.
    pub(crate) share: f64,
    pub(crate) surface: Surface,
}

/// A pixel and what was observed there.
#[derive(Clone, Debug)]
pub(crate) struct Pixel {
    pub(crate) samples: Vec<Sample>,
    /// Colour and haze.
    pub(crate) target: [f64; 4],
    pub(crate) weight: f64,
}

/// One view.
#[derive(Clone, Debug)]
pub(crate) struct View {
    pub(crate) pixels: Vec<Pixel>,
    /// At and beyond which targets only say "at most" and "at least".
    pub(crate) clip: Option<[f64; 2]>,
}

/// All that stays the same while constants are fitted.
#[derive(Clone, Debug)]
pub(crate) struct Scene {
    pub(crate) form: Form,
    pub(crate) silhouette: Silhouette,
    pub(crate) variant: Variant,
    pub(crate) loss: Loss,
    pub(crate) lights: Lights,
    pub(crate) views: Vec<View>,
}

/// Where it is evaluated.
#[derive(Clone, Debug)]
pub(crate) struct At {
    pub(crate) constants: Constants,
    /// A factor on each view.
    pub(crate) gains: Vec<[f64; 3]>,
}

/// One unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unknown {
    /// All channels of a constant.
    Tied(&'static str),
    /// One channel of it.
    Channel(&'static str, usize),
    /// All channels of a view's gain.
    Gain(usize),
    /// One channel of it; alpha goes with green.
    ChannelGain(usize, usize),
}

/// Loss, gradient and normal equations.
#[derive(Clone, Debug)]
pub(crate) struct Equations {
    pub(crate) loss: f64,
    /// Sum of the weights of all residuals.
    pub(crate) weight: f64,
    /// r^T r
    pub(crate) residual: f64,
    pub(crate) gradient: Vec<f64>,
    /// J^T r
    pub(crate) jtr: Vec<f64>,
    /// J^T J, row-major
    pub(crate) jtj: Vec<f64>,
}

impl Unknown {
    pub(crate) fn value(self, at: &At) -> f64 {
        let mut at = at.clone();
        match self {
            Self::Tied(name) => at.constants.of(name)[0],
            Self::Channel(name, c) => at.constants.of(name)[c],
            Self::Gain(view) => at.gains[view][0],
            Self::ChannelGain(view, c) => at.gains[view][c],
        }
    }

    /// `at` with this unknown at `value`.
    pub(crate) fn set(self, at: &At, value: f64) -> At {
        let mut at = at.clone();
        match self {
            Self::Tied(name) => *at.constants.of(name) = [value; 3],
            Self::Channel(name, c) => at.constants.of(name)[c] = value,
            Self::Gain(view) => at.gains[view] = [value; 3],
            Self::ChannelGain(view, c) => at.gains[view][c] = value,
        }
        at
    }

    /// `at` with this unknown greater by so much; of a tied constant every channel, which may differ.
    pub(crate) fn moved(self, at: &At, by: f64) -> At {
        let mut at = at.clone();
        match self {
            Self::Tied(name) => at.constants.of(name).iter_mut().for_each(|x| *x += by),
            Self::Channel(name, c) => at.constants.of(name)[c] += by,
            Self::Gain(view) => at.gains[view].iter_mut().for_each(|x| *x += by),
            Self::ChannelGain(view, c) => at.gains[view][c] += by,
        }
        at
    }

    /// The step of central differences: 1e-6 of what moves the image by about 1 (a radian, an e-folding of the lobe),
    /// so that h^2 of curvature and 1e-16 / h of rounding are both below 1e-9, and hardly any lookup crosses a texel's
    /// border within a step.
    fn step(self, at: &At) -> f64 {
        match self {
            Self::Tied("environment_rotation" | "key_azimuth" | "key_elevation") => 5e-5,
            Self::Tied("specular_lobe") => 1e-6 * self.value(at),
            _ => 1e-6,
        }
    }

    pub(crate) fn name(self) -> String {
        match self {
            Self::Tied(name) => name.to_owned(),
            Self::Channel(name, c) => format!("{name}[{c}]"),
            Self::Gain(view) => format!("gain {view}"),
            Self::ChannelGain(view, c) => format!("gain {view}[{c}]"),
        }
    }
}

/// A pixel times a gain; alpha is exposed as green is.
pub(crate) fn gained(pixel: [f64; 4], [r, g, b]: [f64; 3]) -> [f64; 4] {
    [r * pixel[0], g * pixel[1], b * pixel[2], g * pixel[3]]
}

/// A central difference of some function of a point along an unknown.
fn difference<T>(unknown: Unknown, at: &At, of: impl Fn(&At) -> T, over: impl Fn(T, T, f64) -> T) -> T {
    let h = unknown.step(at);
    over(of(&unknown.moved(at, h)), of(&unknown.moved(at, -h)), 2.0 * h)
}

impl Scene {
    /// Each view's pixels, their gains not applied.
    pub(crate) fn unscaled(&self, constants: &Constants) -> Vec<Vec<[f64; 4]>> {
        let pixel = |pixel: &Pixel| {
            pixel.samples.iter().fold([0.0; 4], |mean, sample| {
                let Self { form, silhouette, variant, lights, .. } = self;
                let light = shade(*form, *silhouette, *variant, &sample.surface, lights, constants).rgba;
                std::array::from_fn(|c| mean[c] + sample.share * light[c])
            })
        };
        self.views.iter().map(|view| view.pixels.iter().map(pixel).collect()).collect()
    }

    /// Each view's image.
    pub(crate) fn image(&self, at: &At) -> Vec<Vec<[f64; 4]>> {
        let mut image = self.unscaled(&at.constants);
        for (view, &gain) in image.iter_mut().zip(&at.gains) {
            view.iter_mut().for_each(|pixel| *pixel = gained(*pixel, gain));
        }
        image
    }

    /// Every residual of an image: model, target, and the weight, which is 0 where nothing is asked beyond a clip.
    fn residuals(&self, image: &[Vec<[f64; 4]>]) -> Vec<[f64; 3]> {
        let mut list = Vec::new();
        for (view, image) in self.views.iter().zip(image) {
            for (pixel, shown) in view.pixels.iter().zip(image) {
                for (&model, &target) in shown.iter().zip(&pixel.target) {
                    let beyond = view.clip.is_some_and(|[low, high]| {
                        (target <= low && model <= target) || (target >= high && model >= target)
                    });
                    list.push([model, target, if beyond { 0.0 } else { pixel.weight }]);
                }
            }
        }
        list
    }

    /// The sum of all weights, clipped or not.
    fn weight(&self) -> f64 {
        4.0 * self.views.iter().flat_map(|view| &view.pixels).map(|pixel| pixel.weight).sum::<f64>()
    }

    /// The weighted mean of the residuals' losses.
    pub(crate) fn loss(&self, at: &At) -> f64 {
        let sum: f64 = self.residuals(&self.image(at)).iter().map(|[m, t, w]| w * self.loss.of(*m, *t)).sum();
        sum / self.weight()
    }

    /// The column of the Jacobian: d image / d unknown, in the order of the residuals.
    pub(crate) fn column(&self, unknown: Unknown, at: &At) -> Vec<f64> {
        let flat = |at: &At| self.image(at).concat().concat();
        difference(unknown, at, flat, |up, down, h| up.iter().zip(&down).map(|(a, b)| (a - b) / h).collect())
    }

    pub(crate) fn equations(&self, at: &At, unknowns: &[Unknown]) -> Equations {
        let rows = self.residuals(&self.image(at));
        let columns: Vec<Vec<f64>> = unknowns.iter().map(|&unknown| self.column(unknown, at)).collect();
        let weight = self.weight();
        let gradient: Vec<f64> =
            unknowns.iter().map(|&u| difference(u, at, |at| self.loss(at), |a, b, h| (a - b) / h)).collect();
        let reweight: Vec<f64> = rows.iter().map(|[m, t, w]| w * self.loss.reweight(*m, *t)).collect();
        let product = |a: &[f64], b: &[f64]| -> f64 {
            reweight.iter().zip(a).zip(b).map(|((weight, a), b)| weight * a * b).sum()
        };
        // The residual of the reweighted quadratic: the one whose square has the loss' slope.
        let residual = rows
            .iter()
            .map(|[m, t, w]| w * (self.loss.slope(*m, *t) / 2.0).powi(2) / self.loss.reweight(*m, *t));
        Equations {
            loss: self.loss(at),
            weight,
            residual: residual.sum(),
            jtr: gradient.iter().map(|slope| slope * weight / 2.0).collect(),
            jtj: columns.iter().flat_map(|a| columns.iter().map(|b| product(a, b))).collect(),
            gradient,
        }
    }
}
