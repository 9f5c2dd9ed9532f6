//! The words by which Python names the choices of the core.

use ble_unwrap_core::embedding::{Evidence, Initial, Model, Update};
use ble_unwrap_core::geodesics::Metric;
use ble_unwrap_core::packing::Rotation;
use ble_unwrap_core::standalone::Connect;
use ble_unwrap_core::stretch::Solver;
use ble_unwrap_core::{ChartScale, Holes, LimitOver};

/// A choice that has a word for each of its values.
pub(crate) trait Words {
    /// All words, the usual one first.
    fn words(&self) -> Vec<&'static str>;
    /// The word of the present value.
    fn word(&self) -> &'static str;
    /// Chooses by word; whether there is such a word.
    fn set(&mut self, word: &str) -> bool;
}

/// Gives the values of a choice their words, the usual one first.
macro_rules! words {
    ($choice:ty { $($word:literal => $value:ident),+ $(,)? }) => {
        impl $crate::words::Words for $choice {
            fn words(&self) -> Vec<&'static str> {
                vec![$($word),+]
            }

            fn word(&self) -> &'static str {
                match self {
                    $(Self::$value => $word),+
                }
            }

            fn set(&mut self, word: &str) -> bool {
                match word {
                    $($word => *self = Self::$value,)+
                    _ => return false,
                }
                true
            }
        }
    };
}

pub(crate) use words;

words!(Evidence { "distances" => SquaredDistances, "affinities" => Affinities });
words!(Holes { "keep" => Keep, "cut" => Cut });
words!(ChartScale { "uniform" => Uniform, "stretch" => Stretch });
words!(LimitOver { "chart" => Chart, "atlas" => Atlas });
words!(Connect { "error" => Error, "bridge" => Bridge, "separate" => Separate });
words!(Metric { "fast_marching" => FastMarching, "dijkstra" => Dijkstra });
words!(Model { "default" => Default, "paper" => Paper, "isomap" => Isomap });
words!(Update { "serial" => Serial, "parallel" => Parallel });
words!(Initial { "mds" => Mds, "random" => Random });
words!(Solver { "newton" => Newton, "line_search" => LineSearch });
words!(Rotation { "any" => Any, "quarter" => Quarter, "none" => None });

/// Words in quotes as English lists them: `'a', 'b' or 'c'`.
pub(crate) fn listed(words: &[&str]) -> String {
    let quoted: Vec<String> = words.iter().map(|word| format!("'{word}'")).collect();
    match quoted.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => quoted.concat(),
    }
}
