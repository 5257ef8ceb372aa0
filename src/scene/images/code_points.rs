//! PNG's `cICP`: colours by the numbers of ITU-T H.273.

use glam::DVec2;
use moxcms::{CicpColorPrimaries, ColorPrimaries, TransferCharacteristics};

use super::chromaticities::Chromaticities;
use super::space::{Curve, Space, Unheeded};
use super::srgb_decode;

/// Transfers of displays' or scenes' light whose highest code is white (H.273, table 3).
const WITH_WHITE: [u8; 8] = [1, 4, 5, 6, 7, 8, 14, 15];
const SRGB: u8 = 13;
/// PQ and HLG, whose white is wherever the picture has it.
const WITHOUT_WHITE: [(u8, &str); 2] = [(16, "PQ"), (18, "HLG")];

/// The space of primaries, transfer, matrix and range.
pub(super) fn space(points: [u8; 4]) -> Result<Option<Space>, Unheeded> {
    let [primaries, transfer, matrix, full] = points;
    let named = || {
        let [a, b, c, d] = points;
        Unheeded::Told(format!("has the `cICP` {a}, {b}, {c}, {d}"))
    };
    if let Some((_, name)) = WITHOUT_WHITE.iter().find(|(number, _)| *number == transfer) {
        return Err(Unheeded::Lost(without_white(name)));
    }
    // PNG, section 11.3.2.6: other matrices are not of RGB. Codes that leave a margin at both ends are no picture's.
    if matrix != 0 || full != 1 {
        return Err(named());
    }
    let colours = chromaticities(primaries).ok_or_else(named)?;
    let curve = || curve(transfer).ok_or_else(named);
    Space::new([curve()?, curve()?, curve()?], Some(colours))
}

/// What a file of such light has.
pub(super) fn without_white(name: &str) -> String {
    format!("holds colours in {name}, brighter than a white that it does not tell")
}

/// Whether this is one of the transfers whose white is not told, and its name.
pub(super) fn lacks_white(transfer: TransferCharacteristics) -> Option<&'static str> {
    WITHOUT_WHITE.iter().find(|(number, _)| *number == transfer as u8).map(|(_, name)| *name)
}

fn curve(transfer: u8) -> Option<Curve> {
    if transfer == SRGB {
        return Some(Box::new(srgb_decode));
    }
    let known =
        TransferCharacteristics::try_from(transfer).ok().filter(|_| WITH_WHITE.contains(&transfer))?;
    Some(Box::new(move |code: f64| known.linearize(code)))
}

/// H.273, table 2.
fn chromaticities(number: u8) -> Option<Chromaticities> {
    let named = CicpColorPrimaries::try_from(number).ok()?;
    let ColorPrimaries { red, green, blue } = named.try_into().ok()?;
    let white = match number {
        // Illuminant C.
        4 | 8 => DVec2::new(0.310, 0.316),
        10 => DVec2::splat(1.0 / 3.0),
        // A cinema's projector.
        11 => DVec2::new(0.314, 0.351),
        _ => DVec2::new(0.3127, 0.3290),
    };
    // To the four digits of the table, of which the library has f32.
    let digits = |x: f32| (f64::from(x) * 1e4).round() / 1e4;
    let point = |at: moxcms::Chromaticity| DVec2::new(digits(at.x), digits(at.y));
    Some(Chromaticities { primaries: [red, green, blue].map(point), white })
}
