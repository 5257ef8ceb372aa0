//! The fit as it goes: its loss, and how far each constant has come.

use eframe::egui::Ui;
use egui_plot::{Legend, Line, Plot, PlotPoints};

use crate::fitting::{Step, shares};
use crate::model::params::Column;

/// The ways that a scene's constants have gone.
#[derive(Clone, Copy)]
pub(crate) struct Ways<'a> {
    pub(crate) path: &'a [Step],
    pub(crate) scene: usize,
    pub(crate) free: &'a [Column],
}

/// Two plots side by side, `height` points high.
pub(crate) fn show(ui: &mut Ui, losses: &[f64], Ways { path, scene, free }: Ways<'_>, height: f32) {
    if losses.is_empty() {
        ui.weak("The loss and the constants are plotted here while a fit runs.");
        return;
    }
    let losses: Vec<[f64; 2]> =
        losses.iter().enumerate().map(|(i, loss)| [i as f64, loss.max(1e-300).log10()]).collect();
    ui.columns(2, |columns| {
        plot("loss", height).y_axis_label("lg loss").x_axis_label("iteration").show(
            &mut columns[0],
            |plot| {
                plot.line(Line::new("loss", PlotPoints::from(losses)));
            },
        );
        let names = plot("constants", height).legend(Legend::default());
        names.y_axis_label("share of the way").x_axis_label("iteration").show(&mut columns[1], |plot| {
            for column in free {
                plot.line(Line::new(column.name(), PlotPoints::from(shares(path, scene, *column))));
            }
        });
    });
}

fn plot(name: &str, height: f32) -> Plot<'_> {
    Plot::new(name)
        .height(height)
        .allow_scroll(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
}
