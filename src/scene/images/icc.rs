//! ICC profiles of a matrix and tone curves, and of grey (ICC.1:2022).

use glam::{DVec2, DVec3};
use moxcms::{ColorProfile, DataColorSpace, ParsingOptions, ToneReprCurve, Xyzd};

use super::chromaticities::Chromaticities;
use super::code_points::{lacks_white, without_white};
use super::space::{Curve, Space, Unheeded};

/// Points of a tone curve that are read: one for each code of 16 bits, and one more.
const MOST_POINTS: usize = (1 << 16) + 1;

/// The space of a profile, in a file of grey or of colours.
pub(super) fn space(bytes: &[u8], grey: bool) -> Result<Option<Space>, Unheeded> {
    let told = |what: String| Unheeded::Told(format!("has a colour profile that {what}"));
    let options = ParsingOptions { max_allowed_trc_size: MOST_POINTS, ..ParsingOptions::default() };
    let profile = ColorProfile::new_from_slice_with_options(bytes, options)
        .map_err(|error| told(format!("is damaged ({error})")))?;
    if let Some(name) = profile.cicp.as_ref().and_then(|cicp| lacks_white(cicp.transfer_characteristics)) {
        return Err(Unheeded::Lost(without_white(name)));
    }
    match profile.color_space {
        DataColorSpace::Rgb => of_colours(&profile),
        DataColorSpace::Gray if grey => of_grey(&profile),
        DataColorSpace::Gray => Err(told("is of grey, and the image has colours".to_owned())),
        other => Err(told(format!("is of {other:?}, neither of RGB nor of grey"))),
    }
}

/// Three curves, and colorants as they are under the profile's white (ICC.1:2022, annex F.3).
fn of_colours(profile: &ColorProfile) -> Result<Option<Space>, Unheeded> {
    let tables =
        || Unheeded::Told("has a colour profile of tables, without a matrix and tone curves".to_owned());
    let curves = [&profile.red_trc, &profile.green_trc, &profile.blue_trc];
    let [Some(red), Some(green), Some(blue)] = curves else { return Err(tables()) };
    if profile.pcs != DataColorSpace::Xyz {
        return Err(tables());
    }
    let colorants = [profile.red_colorant, profile.green_colorant, profile.blue_colorant];
    let colorants = colorants.map(|Xyzd { x, y, z }| DVec3::new(x, y, z));
    // Equal shares are white: adapted to the profile's D50 or, in old profiles, to nothing.
    let white = colorants.iter().sum();
    let colours = Chromaticities { primaries: colorants.map(xy), white: xy(white) };
    Space::new([curve(red), curve(green), curve(blue)], Some(colours))
}

/// One curve, from grey to grey (annex F.2).
fn of_grey(profile: &ColorProfile) -> Result<Option<Space>, Unheeded> {
    let none = || Unheeded::Told("has a colour profile of grey without a tone curve".to_owned());
    let given = profile.gray_trc.as_ref().ok_or_else(none)?;
    // There the curve gives L*, and not Y.
    if profile.pcs != DataColorSpace::Xyz {
        return Err(Unheeded::Told("has a colour profile of grey by L*".to_owned()));
    }
    Space::new([curve(given), curve(given), curve(given)], None)
}

fn xy(xyz: DVec3) -> DVec2 {
    xyz.truncate() / xyz.element_sum()
}

/// A tone curve, clipped to [0, 1]: a table, a power, or one of five formulas (ICC.1:2022, 10.6 and 10.18).
fn curve(given: &ToneReprCurve) -> Curve {
    match given {
        ToneReprCurve::Lut(points) => match points.as_slice() {
            [] => Box::new(|code| code),
            // In 256ths.
            &[power] => Box::new(move |code: f64| code.powf(f64::from(power) / 256.0)),
            points => {
                let points: Vec<f64> = points.iter().map(|&point| f64::from(point) / 65535.0).collect();
                Box::new(move |code| between(&points, code))
            }
        },
        ToneReprCurve::Parametric(numbers) => {
            let numbers: Vec<f64> = numbers.iter().map(|&number| f64::from(number)).collect();
            Box::new(move |code| formula(&numbers, code).clamp(0.0, 1.0))
        }
    }
}

/// On the straight line between the two points about it.
fn between(points: &[f64], code: f64) -> f64 {
    let at = code.clamp(0.0, 1.0) * (points.len() - 1) as f64;
    let left = (at as usize).min(points.len() - 2);
    let share = at - left as f64;
    points[left] * (1.0 - share) + points[left + 1] * share
}

/// The formulas of table 68, by how many numbers they have; no number where there is no such formula.
fn formula(numbers: &[f64], x: f64) -> f64 {
    // Below the bend, `c x + f`; from it, `(a x + b)^g + e`.
    let (g, [a, b, c, d, e, f]) = match *numbers {
        [g] => (g, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        [g, a, b] => (g, [a, b, 0.0, -b / a, 0.0, 0.0]),
        [g, a, b, c] => (g, [a, b, 0.0, -b / a, c, c]),
        [g, a, b, c, d] => (g, [a, b, c, d, 0.0, 0.0]),
        [g, a, b, c, d, e, f] => (g, [a, b, c, d, e, f]),
        _ => return f64::NAN,
    };
    // A base below 0, of a damaged profile, has no power.
    if x >= d { (a * x + b).max(0.0).powf(g) + e } else { c * x + f }
}
