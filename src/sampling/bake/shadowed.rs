//! Transfer vectors and the environment's coefficients put together: the light that arrives at each vertex (MODEL 10).
//!
//! A turn of the environment by r multiplies what goes with the azimuthal order m by cos(m r) and sin(m r). So a
//! vertex' light at every turn is sum over m of cos(m r) P_m + sin(m r) Q_m, with P and Q made once.

use super::coefficients::Coefficients;
use super::harmonics::Order;

/// The least that open light counts as, as a share of the mean radiance, where shadowed light is divided by it.
const LEAST: f64 = 1e-4;
/// The same where light that the surface throws back is divided by it and the sky's own is not. Six bands make
/// irradiance over pi too small by up to an eighth of the mean radiance: most by a light from one direction, opposite
/// to it, where the series of the cosine lobe from l = 6 on is 1/8 of it; of all light together no more. So a surface
/// that really receives E, times this share, shows at most twice what is thrown back, however its harmonics ring.
const SHORTFALL: f64 = 0.125;

/// A number of a transfer vector: of all channels alike, or rgb.
pub trait Share: Copy + Sync {
    /// As rgb.
    fn rgb(self) -> [f64; 3];
}

impl Share for f32 {
    fn rgb(self) -> [f64; 3] {
        [f64::from(self); 3]
    }
}

impl Share for f64 {
    fn rgb(self) -> [f64; 3] {
        [self; 3]
    }
}

impl Share for [f32; 3] {
    fn rgb(self) -> [f64; 3] {
        self.map(f64::from)
    }
}

/// Irradiance over pi of one vertex for every turn of the light, rgb; not floored at 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Turning {
    /// P_m for m = 0 .. 5, of the order's bands.
    pub cosines: [[f64; 3]; 6],
    /// Q_m; Q_0 is 0.
    pub sines: [[f64; 3]; 6],
}

impl Turning {
    /// What arrives of `light` through a transfer vector, over the bands that both have.
    #[must_use]
    pub fn of<T: Share>(transfer: &[T], light: &Coefficients) -> Self {
        let mut turning = Self::default();
        for ((l, m), (share, _)) in light.order().of_each().zip(transfer.iter().zip(light.rgb())) {
            let order = m.unsigned_abs() as usize;
            // The partner of -m, m.
            let own = light.rgb()[(l * l + l).wrapping_add_signed(m as isize)];
            let other = light.rgb()[(l * l + l).wrapping_add_signed(-m as isize)];
            // cos(m r) c - sin(m r) s with m > 0, cos(m r) s + sin(m r) c with m < 0.
            let sign = f64::from(-m.signum());
            for (c, share) in share.rgb().into_iter().enumerate() {
                turning.cosines[order][c] += share * own[c];
                turning.sines[order][c] += sign * share * other[c];
            }
        }
        turning
    }

    /// At a turn about +Y.
    #[must_use]
    pub fn at(&self, radians: f64) -> [f64; 3] {
        self.sum(|m| {
            let (sine, cosine) = (m * radians).sin_cos();
            [cosine, sine]
        })
    }

    /// The derivative of [`Self::at`] by the angle.
    #[must_use]
    pub fn slope(&self, radians: f64) -> [f64; 3] {
        self.sum(|m| {
            let (sine, cosine) = (m * radians).sin_cos();
            [-m * sine, m * cosine]
        })
    }

    /// The second derivative.
    #[must_use]
    pub fn curve(&self, radians: f64) -> [f64; 3] {
        self.sum(|m| {
            let (sine, cosine) = (m * radians).sin_cos();
            [-m * m * cosine, -m * m * sine]
        })
    }

    /// What arrives of both.
    #[must_use]
    pub fn with(mut self, other: &Self) -> Self {
        let add = |sums: &mut [[f64; 3]; 6], more: &[[f64; 3]; 6]| {
            sums.iter_mut().flatten().zip(more.iter().flatten()).for_each(|(sum, more)| *sum += more);
        };
        add(&mut self.cosines, &other.cosines);
        add(&mut self.sines, &other.sines);
        self
    }

    fn sum(&self, wave: impl Fn(f64) -> [f64; 2]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (m, (p, q)) in self.cosines.iter().zip(&self.sines).enumerate() {
            let [cosine, sine] = wave(m as f64);
            (0..3).for_each(|c| sum[c] += cosine * p[c] + sine * q[c]);
        }
        sum
    }
}

/// [`Turning`] of each vertex, of transfer vectors of `order` one after another.
#[must_use]
pub fn by_azimuth<T: Share>(transfer: &[T], order: Order, light: &Coefficients) -> Vec<Turning> {
    let light = light.truncated(order);
    transfer.chunks_exact(order.functions()).map(|transfer| Turning::of(transfer, &light)).collect()
}

/// How much of the open light arrives, a channel, and its derivatives by the turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratio {
    /// The ratio, 1 where `transfer` is `open` to the bit and the light above the least that is counted.
    pub value: [f64; 3],
    /// Its derivative by the angle; 0 where shadowed light is floored.
    pub slope: [f64; 3],
    /// The second one, likewise.
    pub curve: [f64; 3],
}

/// max(0, sum T L) / max(sum T_open L, 1e-4 M), M the mean radiance; 0 where M is not above 0.
///
/// `transfer` and `open` are split by [`Turning`]; `mean` is [`Coefficients::mean`] of the same light.
#[must_use]
pub fn shadow_ratio(shadowed: &Turning, open: &Turning, mean: [f64; 3], radians: f64) -> Ratio {
    ratio_above(LEAST, shadowed, open, mean, radians)
}

/// The same of light that the surface throws back alone: [`thrown_share`].
#[must_use]
pub fn thrown_ratio(thrown: &Turning, open: &Turning, mean: [f64; 3], radians: f64) -> Ratio {
    ratio_above(SHORTFALL, thrown, open, mean, radians)
}

fn ratio_above(share: f64, shadowed: &Turning, open: &Turning, mean: [f64; 3], radians: f64) -> Ratio {
    let of = |light: &Turning| [light.at(radians), light.slope(radians), light.curve(radians)];
    let ([s, ds, dds], [u, du, ddu]) = (of(shadowed), of(open));
    let mut ratio = Ratio { value: [0.0; 3], slope: [0.0; 3], curve: [0.0; 3] };
    for c in 0..3 {
        let least = share * mean[c];
        if mean[c] > 0.0 && s[c] > 0.0 {
            let [by, slope, curve] = if u[c] > least { [u[c], du[c], ddu[c]] } else { [least, 0.0, 0.0] };
            ratio.value[c] = s[c] / by;
            ratio.slope[c] = (ds[c] - ratio.value[c] * slope) / by;
            ratio.curve[c] = (dds[c] - 2.0 * ratio.slope[c] * slope - ratio.value[c] * curve) / by;
        }
    }
    ratio
}

/// What of `light` arrives through a transfer vector, over the bands that both have, rgb; not floored at 0.
#[must_use]
pub fn arriving<T: Share>(transfer: &[T], light: &Coefficients) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (share, light) in transfer.iter().zip(light.rgb()) {
        let share = share.rgb();
        (0..3).for_each(|c| sum[c] += share[c] * light[c]);
    }
    sum
}

/// What arrives, as a share of open light: max(0, `arrived`) / max(`open`, 1e-4 M), M the mean radiance; 0 where M is
/// not above 0.
#[must_use]
pub fn share_of_open(arrived: [f64; 3], open: [f64; 3], mean: [f64; 3]) -> [f64; 3] {
    share_above(LEAST, arrived, open, mean)
}

/// What the surface throws back, as a share of open light by six bands: max(0, `thrown`) / max(`open`, M / 8), where
/// the open share of the sky is known beside. Nothing hidden throws nothing back, so the guard changes nothing there.
#[must_use]
pub fn thrown_share(thrown: [f64; 3], open: [f64; 3], mean: [f64; 3]) -> [f64; 3] {
    share_above(SHORTFALL, thrown, open, mean)
}

fn share_above(least: f64, arrived: [f64; 3], open: [f64; 3], mean: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| match mean[c] > 0.0 {
        true => arrived[c].max(0.0) / open[c].max(least * mean[c]),
        false => 0.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::harmonics::{basis, open_transfer};

    fn light() -> Coefficients {
        let numbers = (0..36_u8).map(|i| f64::from(i).sin());
        let rgb = numbers.enumerate().map(|(i, x)| [x, 0.5 * x, if i == 0 { 0.0 } else { -x }]).collect();
        Coefficients::new(Order::MOST, rgb)
    }

    #[test]
    fn a_split_light_is_the_light_turned_and_its_slope_that_of_the_turned_coefficients() {
        let transfer: Vec<f64> = (0..36_u8).map(|i| (2.0 * f64::from(i)).cos()).collect();
        let light = light();
        let turning = Turning::of(&transfer, &light);
        for angle in [0.0, 0.7, -3.0, 12.0] {
            for (got, want) in [
                (turning.at(angle), light.turned(angle).through(&transfer)),
                (turning.slope(angle), light.turning(angle).through(&transfer)),
            ] {
                // Roundings of sums of 36 numbers of up to 5.
                assert!((0..3).all(|c| (got[c] - want[c]).abs() < 1e-12), "{angle}: {got:?} {want:?}");
            }
        }
        // rgb transfer is three transfers; a lower order takes the first bands of the light.
        let order = Order::new(3).unwrap();
        let rgb: Vec<[f32; 3]> = transfer[..9].iter().map(|&t| [t as f32, 0.0, 2.0 * t as f32]).collect();
        let single: Vec<f32> = rgb.iter().map(|t| t[0]).collect();
        let [rgb, single] = [by_azimuth(&rgb, order, &light), by_azimuth(&single, order, &light)];
        assert_eq!((rgb.len(), single.len()), (1, 1));
        let [rgb, single] = [rgb[0].at(1.0), single[0].at(1.0)];
        assert!(rgb[0] == single[0] && rgb[1] == 0.0 && (rgb[2] - 2.0 * single[2]).abs() < 1e-12);
    }

    #[test]
    fn light_that_is_thrown_back_is_at_most_doubled_where_a_sun_rings() {
        let toward = [0.48, 0.6, 0.64];
        // A sun of mean radiance 1.
        let four_pi = 4.0 * std::f64::consts::PI;
        let sun = basis(Order::MOST, toward).iter().map(|y| [four_pi * y; 3]).collect();
        let sun = Coefficients::new(Order::MOST, sun);
        let (mut short, mut least) = (0.0_f64, f64::INFINITY);
        for i in 0..2000_i32 {
            let y = 1.0 - (2.0 * f64::from(i) + 1.0) / 2000.0;
            let (sine, cosine) = (2.399_963_229_728_653 * f64::from(i)).sin_cos();
            let radius = (1.0 - y * y).sqrt();
            let normal = [radius * sine, y, radius * cosine];
            let lit = arriving(&open_transfer(Order::MOST, normal), &sun);
            let real = 4.0 * (0..3).map(|k| normal[k] * toward[k]).sum::<f64>().max(0.0);
            short = short.max(real - lit[0]);
            least = least.min(lit[0]);
            let share = thrown_share([0.3, 0.02, 0.0], lit, sun.mean());
            let shown = share.map(|share| real * share);
            // Roundings of sums of 36 numbers of up to 40.
            assert!(shown[0] <= 0.6 + 1e-9 && shown[1] <= 0.04 + 1e-9 && shown[2] == 0.0, "{normal:?}");
            assert!(share[0] <= 2.4 + 1e-9, "{share:?}");
            if lit[0] > 0.125 {
                assert_eq!(share, share_of_open([0.3, 0.02, 0.0], lit, sun.mean()));
            }
        }
        // They do ring, and fall short by as much as the guard is.
        assert!(least < -0.1 && (0.12..0.125 + 1e-9).contains(&short), "{least} {short}");
    }

    #[test]
    fn open_is_exactly_1_and_a_slope_is_that_of_finite_differences() {
        let light = Coefficients::new(Order::MOST, {
            let mut rgb = light().rgb().to_vec();
            rgb[0] = [9.0, 8.0, -1.0];
            rgb
        });
        let open = Turning::of(&open_transfer(Order::MOST, [0.36, 0.48, 0.8]), &light);
        let shadowed: Vec<f64> =
            open_transfer(Order::MOST, [0.8, -0.36, 0.48]).iter().map(|t| 0.6 * t).collect();
        let shadowed = Turning::of(&shadowed, &light);
        for angle in [0.0, 1.3, -2.0] {
            let same = shadow_ratio(&open, &open, light.mean(), angle);
            // The third channel has no mean light.
            assert_eq!((same.value, same.slope[2]), ([1.0, 1.0, 0.0], 0.0));
            let at = |angle: f64| shadow_ratio(&shadowed, &open, light.mean(), angle);
            let (step, ratio) = (1e-6, at(angle));
            for c in 0..3 {
                let slope = (at(angle + step).value[c] - at(angle - step).value[c]) / (2.0 * step);
                // Roundings of 1e-15 over a step, and third derivatives times its square.
                assert!((slope - ratio.slope[c]).abs() < 1e-8, "{angle}: {slope} {ratio:?}");
                let curve = (at(angle + step).slope[c] - at(angle - step).slope[c]) / (2.0 * step);
                assert!((curve - ratio.curve[c]).abs() < 1e-7, "{angle}: {curve} {ratio:?}");
            }
            assert!((0..2).all(|c| ratio.value[c] > 0.1));
        }
        let black = Coefficients::new(Order::MOST, Vec::new());
        let dark = Turning::of(&[1.0_f32; 36], &black);
        assert_eq!(
            shadow_ratio(&dark, &dark, black.mean(), 0.5),
            Ratio { value: [0.0; 3], slope: [0.0; 3], curve: [0.0; 3] }
        );
    }
}
