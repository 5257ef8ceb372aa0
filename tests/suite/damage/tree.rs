//! Damage to what a JSON or TOML file says, not to its letters: values of another kind or size, keys that are gone,
//! twice there or called otherwise.

use proptest::prelude::*;
use serde_json::{Value, json};

/// What happens to one value of a tree.
#[derive(Clone, Debug)]
enum Harm {
    Replace(Value),
    Remove,
    /// An array's element stands there twice; a key has another beside it.
    Double,
    Rename(&'static str),
}

/// Harm, and to which of a tree's values.
#[derive(Clone, Debug)]
pub(crate) struct TreeDamage(usize, Harm);

/// Words that [`json_text`] and [`toml_text`] put bare what no tree holds for.
const NAN: &str = "@nan";
const INFINITE: &str = "@inf";
const LESS_THAN_ALL: &str = "@-inf";
const DATE: &str = "@date";
const DEEP: &str = "@deep";

/// Some harm to any value.
pub(crate) fn tree_damage() -> impl Strategy<Value = TreeDamage> {
    let odd = vec![
        json!(null),
        json!(true),
        json!(""),
        json!("x"),
        json!("a\nb\u{1b}[2J"),
        json!([]),
        json!({}),
        json!([[1], [2, 3]]),
        json!([1.0, 2.0, 3.0, 4.0]),
        json!(0),
        json!(-1),
        json!(0.5),
        json!(1e300),
        json!(-1e300),
        json!(1e-310),
        json!(i64::MAX),
        json!(i64::MIN),
        json!(u64::MAX),
        json!(NAN),
        json!(INFINITE),
        json!(LESS_THAN_ALL),
        json!(DATE),
        json!(DEEP),
    ];
    let harm = prop_oneof![
        6 => prop::sample::select(odd).prop_map(Harm::Replace),
        2 => Just(Harm::Remove),
        2 => Just(Harm::Double),
        1 => prop::sample::select(vec!["x", "", "a b\n", "job", "params"]).prop_map(Harm::Rename),
    ];
    (any::<u16>().prop_map(usize::from), harm).prop_map(|(at, harm)| TreeDamage(at, harm))
}

/// The pointers (RFC 6901) of every value below `value`.
fn pointers(value: &Value, at: &str, into: &mut Vec<String>) {
    let mut below = |key: String, value: &Value| {
        let at = format!("{at}/{}", key.replace('~', "~0").replace('/', "~1"));
        pointers(value, &at, into);
        into.push(at);
    };
    match value {
        Value::Array(items) => items.iter().enumerate().for_each(|(i, item)| below(i.to_string(), item)),
        Value::Object(map) => map.iter().for_each(|(key, item)| below(key.clone(), item)),
        _ => {}
    }
}

impl TreeDamage {
    pub(crate) fn apply(&self, mut tree: Value) -> Value {
        let Self(index, harm) = self;
        let mut all = Vec::new();
        pointers(&tree, "", &mut all);
        if all.is_empty() {
            return tree;
        }
        let at = &all[index % all.len()];
        let (parent, key) = at.rsplit_once('/').unwrap();
        let key = key.replace("~1", "/").replace("~0", "~");
        if let Harm::Replace(odd) = harm {
            *tree.pointer_mut(at).unwrap() = odd.clone();
            return tree;
        }
        match (tree.pointer_mut(parent).unwrap(), harm) {
            (Value::Array(items), Harm::Remove) => drop(items.remove(key.parse().unwrap())),
            (Value::Array(items), _) => {
                let i: usize = key.parse().unwrap();
                items.insert(i, items[i].clone());
            }
            (Value::Object(map), Harm::Remove) => drop(map.remove(&key)),
            (Value::Object(map), Harm::Double) => drop(map.insert(format!("{key}2"), map[&key].clone())),
            (Value::Object(map), Harm::Rename(name)) => {
                let value = map.remove(&key).unwrap();
                map.insert((*name).to_owned(), value);
            }
            (other, harm) => panic!("{harm:?} of {other}"),
        }
        tree
    }
}

fn with_words(text: &str, words: [&str; 4]) -> String {
    let deep = "[".repeat(5000) + &"]".repeat(5000);
    let marked = [NAN, INFINITE, LESS_THAN_ALL, DATE].into_iter().zip(words).chain([(DEEP, &*deep)]);
    marked.fold(text.to_owned(), |text, (mark, word)| text.replace(&format!("\"{mark}\""), word))
}

/// The tree as JSON.
pub(crate) fn json_text(tree: &Value) -> String {
    with_words(&tree.to_string(), ["NaN", "1e999", "-1e999", "1979-05-27"])
}

/// The tree as TOML; `None` where TOML has no such value.
pub(crate) fn toml_text(tree: &Value) -> Option<String> {
    Some(with_words(&toml::to_string(tree).ok()?, ["nan", "inf", "-inf", "1979-05-27"]))
}

#[test]
fn trees_are_damaged_and_written_with_what_they_cannot_hold() {
    let whole = json!({"a": [1, 2], "b/c": {"d": 0.5}});
    let at = |wanted: &str, harm| {
        let mut all = Vec::new();
        pointers(&whole, "", &mut all);
        let index = all.iter().position(|at| at == wanted).unwrap();
        TreeDamage(index, harm).apply(whole.clone())
    };
    assert_eq!(at("/b~1c/d", Harm::Replace(json!(1))), json!({"a": [1, 2], "b/c": {"d": 1}}));
    assert_eq!(at("/a/0", Harm::Remove), json!({"a": [2], "b/c": {"d": 0.5}}));
    assert_eq!(at("/a/1", Harm::Double), json!({"a": [1, 2, 2], "b/c": {"d": 0.5}}));
    assert_eq!(at("/b~1c", Harm::Rename("x")), json!({"a": [1, 2], "x": {"d": 0.5}}));
    assert_eq!(
        toml_text(&at("/a", Harm::Replace(json!(INFINITE)))).unwrap(),
        "a = inf\n\n[\"b/c\"]\nd = 0.5\n"
    );
    assert_eq!(json_text(&json!([NAN])), "[NaN]");
    assert!(toml_text(&json!({"a": null})).is_none());
}
