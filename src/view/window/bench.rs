//! How fast the window is: from a slider that moves to its image in the window, and frames while nothing or a fit is
//! under way; measured on a window without a display.

use std::time::Duration;

use web_time::Instant;

use crate::host::ViewError;
use crate::paint::Slot;
use crate::values::Values;
use crate::window::offscreen::Offscreen;

/// Moves of the slider.
const MOVES: usize = 60;
/// Frames of each kind at the least, and seconds.
const FRAMES: usize = 120;
const SECONDS: f64 = 2.0;
/// How long an image is waited for.
const PATIENCE: Duration = Duration::from_secs(60);

/// What was measured, milliseconds.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Speed {
    /// What draws the images.
    pub engine: String,
    /// Width and height of the images.
    pub image: [u32; 2],
    /// Width and height of the window.
    pub window: [u32; 2],
    /// From a slider's move to the frame that shows its image: median and 95th percentile.
    pub slider_median: f64,
    /// Its 95th percentile.
    pub slider_95: f64,
    /// A frame of the window in which nothing changes: median and 95th percentile.
    pub frame_median: f64,
    /// Its 95th percentile.
    pub frame_95: f64,
    /// A frame while a fit runs, and with it images are drawn.
    pub fitting_median: f64,
    /// Its 95th percentile.
    pub fitting_95: f64,
    /// Frames of which that is.
    pub fitting_frames: usize,
}

/// Measure a window; its fit goes to its run folder.
///
/// # Errors
/// When the window cannot be drawn, or its scene was refused.
pub fn measure(offscreen: &mut Offscreen, window: [u32; 2]) -> Result<Speed, ViewError> {
    offscreen.settle()?;
    let slider = slider(offscreen)?;
    offscreen.settle()?;
    let frame = frames(offscreen, |_| true)?;
    offscreen.window.session.begin_fit(false);
    let fitting = frames(offscreen, |offscreen| offscreen.window.session.fitting().is_some())?;
    offscreen.settle()?;
    let session = &offscreen.window.session;
    let image = session.camera().map_or([0; 2], |camera| [camera.width, camera.height]);
    Ok(Speed {
        engine: session.engine().to_owned(),
        image,
        window,
        slider_median: at(&slider, 0.5),
        slider_95: at(&slider, 0.95),
        frame_median: at(&frame, 0.5),
        frame_95: at(&frame, 0.95),
        fitting_median: at(&fitting, 0.5),
        fitting_95: at(&fitting, 0.95),
        fitting_frames: fitting.len(),
    })
}

/// Milliseconds from each move of the first slider to the frame with its image.
fn slider(offscreen: &mut Offscreen) -> Result<Vec<f64>, ViewError> {
    let mut times = Vec::new();
    for i in 0..MOVES {
        let session = &mut offscreen.window.session;
        let rows = session.values().map(Values::rows).unwrap_or_default();
        let Some(param) = rows.into_iter().find(|param| param.info().linear) else { break };
        let value = 0.5 + 0.005 * i as f64;
        let start = Instant::now();
        session.edit(|values| values.params.set(param, value));
        loop {
            offscreen.frame()?;
            let now = offscreen.window.session.image(Slot::Now);
            if now.is_some_and(|now| now.job.params.scalar(param) == value) {
                break;
            }
            if start.elapsed() > PATIENCE {
                return Err(ViewError::Scene(offscreen.window.session.told().join("\n")));
            }
        }
        times.push(1e3 * start.elapsed().as_secs_f64());
    }
    Ok(times)
}

/// Milliseconds of frames, while `go_on`.
fn frames(offscreen: &mut Offscreen, go_on: impl Fn(&Offscreen) -> bool) -> Result<Vec<f64>, ViewError> {
    let (mut times, whole) = (Vec::new(), Instant::now());
    while go_on(offscreen) && (times.len() < FRAMES || whole.elapsed().as_secs_f64() < SECONDS) {
        let start = Instant::now();
        offscreen.frame()?;
        times.push(1e3 * start.elapsed().as_secs_f64());
    }
    Ok(times)
}

/// The number below which a share of them lies; 0 of none.
fn at(times: &[f64], share: f64) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    let place = (share * (sorted.len().max(1) - 1) as f64).round() as usize;
    sorted.get(place).copied().unwrap_or(0.0)
}
