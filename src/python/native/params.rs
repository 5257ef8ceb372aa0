//! The values that one edits of a scene, row by row, as the core's table declares them.

use pyo3::types::{PyDict, PyDictMethods};
use pyo3::{Bound, PyResult, Python};
use skinfit_core::model::params::{Column, Param};
use skinfit_core::scene::{Assignment, check_bounds, suggestion};
use skinfit_view::values::{Freedom, Values};

use crate::errors::Refused;

/// What a fit may do to a parameter, in Python's words.
const FREEDOMS: [(&str, Freedom); 3] =
    [("fixed", Freedom::Fixed), ("tied", Freedom::Tied), ("per_channel", Freedom::PerChannel)];

/// The rows that the scene's effects ask for, in the order of the table.
pub(crate) fn rows<'py>(py: Python<'py>, values: &Values) -> PyResult<Vec<Bound<'py, PyDict>>> {
    values.rows().into_iter().map(|param| row(py, values, param)).collect()
}

/// The row of one parameter.
pub(crate) fn row_of<'py>(py: Python<'py>, values: &Values, name: &str) -> PyResult<Bound<'py, PyDict>> {
    row(py, values, known(values, name)?)
}

fn row<'py>(py: Python<'py>, values: &Values, param: Param) -> PyResult<Bound<'py, PyDict>> {
    let info = param.info();
    let row = PyDict::new(py);
    row.set_item("name", info.name)?;
    row.set_item("value", values.params.rgb(param))?;
    row.set_item("default", param.default_rgb(values.form))?;
    row.set_item("bounds", values.bounds.of(param))?;
    row.set_item("limits", (info.lower, info.upper))?;
    row.set_item("unit", info.unit)?;
    row.set_item("free", word(values.freedom(param)))?;
    row.set_item("rgb", info.rgb)?;
    row.set_item("linear", info.linear)?;
    row.set_item("owner", info.owner.name())?;
    row.set_item("meaning", info.meaning)?;
    row.set_item("source", info.source)?;
    Ok(row)
}

fn word(freedom: Freedom) -> &'static str {
    FREEDOMS.iter().find(|(_, other)| *other == freedom).map_or("fixed", |(word, _)| word)
}

/// Set a parameter to one number, or to one a channel, as words of the command line would.
pub(crate) fn set(values: &mut Values, name: &str, numbers: &[f64]) -> Result<(), Refused> {
    let param = known(values, name)?;
    let numbers: Vec<String> = numbers.iter().map(ToString::to_string).collect();
    let words = format!("{name}={}", numbers.join(","));
    let assignment: Assignment = words.parse().map_err(|error| Refused::Param(format!("{error}")))?;
    assignment.apply(&mut values.params);
    if assignment.coloured && values.freedom(param) == Freedom::Tied {
        // A fit keeps channels apart that were given apart.
        values.set_freedom(param, Freedom::PerChannel);
    }
    Ok(())
}

/// Say what a fit may do to a parameter.
pub(crate) fn set_freedom(values: &mut Values, name: &str, word: &str) -> Result<(), Refused> {
    let param = known(values, name)?;
    let words: Vec<&str> = FREEDOMS.iter().map(|(word, _)| *word).collect();
    let unknown =
        || Refused::Param(format!("`{word}` says nothing of {name}. {}.", suggestion(word, &words)));
    let &(_, freedom) = FREEDOMS.iter().find(|(other, _)| *other == word).ok_or_else(unknown)?;
    if freedom == Freedom::PerChannel && !param.info().rgb {
        return Err(Refused::Param(format!(
            "{name} takes one value, not one a channel. Leave it free as one."
        )));
    }
    values.set_freedom(param, freedom);
    Ok(())
}

/// Have a parameter stay within `bounds`, or within the table's.
pub(crate) fn set_bounds(values: &mut Values, name: &str, bounds: Option<[f64; 2]>) -> Result<(), Refused> {
    let param = known(values, name)?;
    let Some(bounds) = bounds else {
        values.bounds.reset(param);
        return Ok(());
    };
    check_bounds(param, bounds).map_err(|(what, remedy)| Refused::Param(format!("{what}. {remedy}.")))?;
    values.bounds.set(param, bounds);
    Ok(())
}

/// Whether the model has a parameter of that name, and the scene no row.
pub(crate) fn is_idle(values: &Values, name: &str) -> bool {
    Param::from_name(name).is_some_and(|param| !values.rows().contains(&param))
}

/// The parameter of that name among the scene's rows.
fn known(values: &Values, name: &str) -> Result<Param, Refused> {
    let rows = values.rows();
    let names: Vec<&str> = rows.iter().map(|param| param.name()).collect();
    let unknown = || {
        let (name, known) = (name.trim(), suggestion(name, &names));
        match Param::from_name(name) {
            Some(_) => Refused::Param(format!("no enabled effect of the scene asks for {name}. {known}.")),
            None => Refused::Param(format!("unknown parameter `{name}`. {known}.")),
        }
    };
    rows.iter().copied().find(|param| param.name() == name).ok_or_else(unknown)
}

/// The names of what a fit moves, as reports have them: `rim_exponent`, `hilite.r`.
pub(crate) fn free_names(values: &Values) -> Vec<String> {
    values.free.iter().map(Column::name).collect()
}
