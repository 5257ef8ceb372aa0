//! A parameter's value as words of a command line: `rim_exponent=3`, `hilite=0.7,0.6,0.5`.

use std::fmt;
use std::str::FromStr;

use super::numbers::short;
use super::settings::check_value;
use super::suggestion;
use crate::model::params::{Param, Params};

/// A parameter and the value that somebody gave it: one number, or one for each channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assignment {
    /// The parameter.
    pub param: Param,
    rgb: [f64; 3],
    /// Whether each channel was given a number of its own: a fit then keeps them apart, whatever they are.
    pub coloured: bool,
}

/// Words that assign no parameter a value that it may have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct AssignmentError(String);

impl Assignment {
    /// Set the parameter.
    pub fn apply(&self, params: &mut Params) {
        params.set_rgb(self.param, self.rgb);
    }
}

impl FromStr for Assignment {
    type Err = AssignmentError;

    fn from_str(words: &str) -> Result<Self, AssignmentError> {
        let Some((name, value)) = words.split_once('=') else {
            return Err(AssignmentError("give a name and a value, such as rim_exponent=3".to_owned()));
        };
        let name = name.trim();
        let param = Param::from_name(name).ok_or_else(|| {
            let known: Vec<&str> = Param::all().map(Param::name).collect();
            AssignmentError(format!("unknown parameter `{name}`. {}.", suggestion(name, &known)))
        })?;
        // As TOML and JSON write it, too.
        let value = value.trim();
        let value = value.strip_prefix('[').and_then(|list| list.strip_suffix(']')).unwrap_or(value);
        let numbers: Result<Vec<f64>, _> = value.split(',').map(|number| number.trim().parse()).collect();
        let (rgb, coloured) = match numbers.as_deref() {
            Ok(&[one]) => ([one; 3], false),
            Ok(&[r, g, b]) => ([r, g, b], true),
            _ => {
                let kind = if param.info().rgb { "one number, or three: 0.7,0.6,0.5" } else { "one number" };
                return Err(AssignmentError(format!("{name} takes {kind}, not `{value}`.")));
            }
        };
        if coloured && !param.info().rgb {
            return Err(AssignmentError(format!("{name} takes one value, not one a channel.")));
        }
        check_value(param, rgb).map_err(|(what, remedy)| AssignmentError(format!("{what}. {remedy}.")))?;
        Ok(Self { param, rgb, coloured })
    }
}

impl fmt::Display for Assignment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let numbers: Vec<String> = self.rgb.iter().map(|&x| short(x)).collect();
        let value = if self.coloured { numbers.join(",") } else { numbers[0].clone() };
        write!(f, "{}={value}", self.param.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::Form;

    #[test]
    fn words_set_what_they_name_and_say_it_again() {
        let mut params = Params::defaults(Form::Corrected);
        for (words, again) in [
            ("rim_exponent=3", "rim_exponent=3"),
            ("hilite = [0.7, 0.6, 0.5]", "hilite=0.7,0.6,0.5"),
            ("base_weight=1e-3", "base_weight=0.001"),
            ("rim_weight=-2", "rim_weight=-2"),
        ] {
            let assignment: Assignment = words.parse().unwrap();
            assignment.apply(&mut params);
            assert_eq!(assignment.to_string(), again);
            assert_eq!(again.parse(), Ok(assignment));
        }
        assert_eq!(params.scalar(Param::RimExponent), 3.0);
        assert_eq!(params.rgb(Param::Hilite), [0.7, 0.6, 0.5]);
        // Three that are equal are still three.
        assert!("hilite=1,1,1".parse::<Assignment>().unwrap().coloured);
    }

    #[test]
    fn what_is_no_value_of_the_table_is_refused_with_what_is() {
        for (words, told) in [
            ("rim_exponent", "such as rim_exponent=3"),
            ("rim_exponnt=3", "unknown parameter `rim_exponnt`. Did you mean `rim_exponent`?"),
            ("rim_exponent=99", "rim_exponent = 99 is out of bounds. Give a finite number in [0.25, 16]."),
            ("hilite=0.1,-1,0.1", "hilite = -1 is out of bounds"),
            ("hilite=inf", "hilite = inf is out of bounds"),
            ("hilite=nan", "hilite = NaN is out of bounds"),
            ("hilite=0.1,0.2", "hilite takes one number, or three: 0.7,0.6,0.5, not `0.1,0.2`"),
            ("hilite=", "hilite takes one number, or three"),
            ("hilite=red", "not `red`"),
            ("occlusion=1,1,1", "occlusion takes one value, not one a channel"),
            ("occlusion=1,1", "occlusion takes one number, not `1,1`"),
        ] {
            let error = words.parse::<Assignment>().unwrap_err().to_string();
            assert!(error.contains(told), "{words}: {error}");
        }
    }
}
