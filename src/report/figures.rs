//! The views of the page: pictures inside it, as PNG in base 64.

use std::fmt::Write as _;

use super::ViewEvidence;
use super::page::escape;
use super::pictures::Picture;
use super::signed;
use super::view_summary::ViewSummary;
use crate::render::files::{Image, encode_png};

/// The longest side of a picture in the page; larger ones are shrunk by a whole factor.
pub const LONGEST: usize = 1024;
/// The same for the small pictures of single terms.
const LONGEST_TERM: usize = 320;

const FLIP_LEGEND: &str = "FLIP error <span class=\"bar\"><i>0</i><b></b><i>1</i></span>";

/// One view: its scores, target, fit and errors (signed ones up to `scale`), and the terms of the fit.
///
/// # Errors
/// When a picture cannot be encoded.
pub(super) fn view(
    view: &ViewEvidence,
    scores: &ViewSummary,
    error: &Picture,
    scale: f64,
) -> Result<String, String> {
    let name = escape(&view.name);
    let target = Picture::of_image(&view.target.shrunk(LONGEST));
    let fit = Picture::of_image(&view.fit.shrunk(LONGEST));
    let signed = signed::picture(view, scale);
    let triple = side_by_side(
        &format!("view {}", view.name),
        [&target, &fit],
        ["target", "fit", "wipe in the target"],
        &[("FLIP error", FLIP_LEGEND, error), ("signed error", &signed::legend(scale), &signed)],
    )?;
    let held = if view.held_out { " <span class=\"pill\">held out</span>" } else { "" };
    let (scores, terms) = (score_list(scores), terms(view)?);
    Ok(format!(
        "<article class=\"view\"><header><h3>{name}{held}</h3>{scores}</header>{triple}{terms}</article>"
    ))
}

/// Two pictures of one thing and the error between them, side by side; `words` name the first and the
/// second, and say what dragging across the second does.
///
/// # Errors
/// When a picture cannot be encoded.
pub fn triple(
    name: &str,
    before: &Picture,
    after: &Picture,
    error: &Picture,
    [first, second, wipe]: [&str; 3],
) -> Result<String, String> {
    let third = ["FLIP error", FLIP_LEGEND];
    triple_of(&format!("view {name}"), [before, after, error], [first, second, wipe], third)
}

/// Three pictures of `subject` side by side, of which the first can be wiped over the second; `third` says what the
/// last one is, and its caption in HTML.
pub(super) fn triple_of(
    subject: &str,
    [before, after, third]: [&Picture; 3],
    words: [&str; 3],
    [what, caption]: [&str; 2],
) -> Result<String, String> {
    side_by_side(subject, [before, after], words, &[(what, caption, third)])
}

/// Two pictures of `subject`, of which the first can be wiped over the second, and one or two of the error between
/// them, with what each is and its caption in HTML.
fn side_by_side(
    subject: &str,
    [before, after]: [&Picture; 2],
    [first, second, wipe]: [&str; 3],
    errors: &[(&str, &str, &Picture)],
) -> Result<String, String> {
    let subject = escape(subject);
    let hint = format!("{second}<span class=\"hint\" hidden> · drag across it to {wipe}</span>");
    // Single pixels of a tiny image are meant to be seen.
    let frame = if after.width < 200 { "frame tiny" } else { "frame" };
    let (width, height) = (after.width, after.height);
    let figure = |(picture, what, caption): (&Picture, &str, String)| {
        let uri = data_uri(&thinned(picture, LONGEST))?;
        Ok(format!(
            "<figure><div class=\"{frame}\"><img src=\"{uri}\" width=\"{width}\" height=\"{height}\" \
             alt=\"{what} of {subject}\"></div><figcaption>{caption}</figcaption></figure>"
        ))
    };
    let pair = [(before, first, first.to_owned()), (after, second, hint)];
    let errors = errors.iter().map(|&(what, caption, picture)| (picture, what, caption.to_owned()));
    let figures = pair.into_iter().chain(errors).map(figure).collect::<Result<Vec<_>, String>>()?;
    let class = if figures.len() > 3 { "triple four" } else { "triple" };
    Ok(format!("<div class=\"{class}\">{}</div>", figures.concat()))
}

fn score_list(scores: &ViewSummary) -> String {
    match (scores.psnr, scores.ssim, scores.flip) {
        (Some(psnr), Some(ssim), Some(flip)) => format!(
            "<dl class=\"scores\"><dt>PSNR</dt><dd>{psnr:.2} dB</dd><dt>SSIM</dt><dd>{ssim:.4}</dd>\
             <dt>FLIP</dt><dd>{flip:.4}</dd></dl>"
        ),
        _ => "<p class=\"quiet\">no pixel is fully covered: no scores</p>".to_owned(),
    }
}

/// The terms as small pictures, with their shares of the fitted light.
fn terms(view: &ViewEvidence) -> Result<String, String> {
    if view.terms.is_empty() {
        return Ok(String::new());
    }
    let light = |image: &Image| image.rgb.iter().flatten().map(|c| f64::from(*c)).sum::<f64>();
    let whole = light(&view.fit);
    let mut figures = String::new();
    for (name, image) in &view.terms {
        let share = 100.0 * light(image) / whole;
        let share =
            if share.is_finite() { format!("{share:.1}%").replace('-', "−") } else { "–".to_owned() };
        let shown = Image { alpha: view.fit.alpha.clone(), ..image.clone() };
        let uri = data_uri(&Picture::of_image(&shown.shrunk(LONGEST_TERM)))?;
        let name = escape(name);
        let _ = write!(
            figures,
            "<figure><img src=\"{uri}\" alt=\"term {name}\">\
             <figcaption>{name} <b>{share}</b></figcaption></figure>"
        );
    }
    Ok(format!(
        "<details open><summary>What the fit is made of, and each term's share of its light</summary>\
         <div class=\"terms\">{figures}</div></details>"
    ))
}

/// `picture` as the page holds it.
pub(super) fn data_uri(picture: &Picture) -> Result<String, String> {
    let png = encode_png(picture.width, picture.height, &picture.bytes)?;
    Ok(format!("data:image/png;base64,{}", base64(&png)))
}

/// `picture` with only every n-th pixel of every n-th row, at most `longest` a side: a map of
/// colours has no means.
fn thinned(picture: &Picture, longest: usize) -> Picture {
    let factor = picture.width.max(picture.height).div_ceil(longest).max(1);
    let (width, height) = (picture.width.div_ceil(factor), picture.height.div_ceil(factor));
    let from = |i: usize| 3 * (i / width * factor * picture.width + i % width * factor);
    let bytes =
        (0..width * height).flat_map(|i| picture.bytes[from(i)..from(i) + 3].iter().copied()).collect();
    Picture { width, height, bytes }
}

/// RFC 4648 base 64, with padding.
fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let at = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let word = at(0) << 16 | at(1) << 8 | at(2);
        for i in 0..4 {
            let digit = ALPHABET[(word >> (18 - 6 * i)) as usize & 63];
            text.push(if i <= chunk.len() { char::from(digit) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_agrees_with_the_vectors_of_rfc_4648() {
        let texts = ["", "f", "fo", "foo", "foob", "fooba", "foobar"];
        let codes = ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"];
        for (text, code) in texts.into_iter().zip(codes) {
            assert_eq!(base64(text.as_bytes()), code);
        }
    }

    #[test]
    fn thinning_keeps_every_nth_pixel() {
        let bytes = (0..7 * 5).flat_map(|i| [i; 3]).collect();
        let small = thinned(&Picture { width: 7, height: 5, bytes }, 4);
        assert_eq!((small.width, small.height), (4, 3));
        assert_eq!(
            small.bytes.chunks(3).map(|p| p[0]).collect::<Vec<_>>(),
            [0, 2, 4, 6, 14, 16, 18, 20, 28, 30, 32, 34]
        );
    }
}
