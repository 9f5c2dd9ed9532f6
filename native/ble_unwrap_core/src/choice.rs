//! Settings that are one of a few values: each value has a word, by which callers in other languages name it.

/// What users are told about one value of a choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Named {
    /// The word for the value in Python, on the command line and in files.
    pub word: &'static str,
    /// The name of the value on the screen.
    pub label: &'static str,
    /// What the value means, in one or two sentences.
    pub sentence: &'static str,
}

/// An enumeration each of whose values has a word.
pub trait Choice {
    /// All values, in the order in which they are shown.
    fn all(&self) -> &'static [Named];

    /// The word of the present value.
    fn word(&self) -> &'static str;

    /// Takes the value with this word. Returns false, and changes nothing, if no value has it.
    fn choose(&mut self, word: &str) -> bool;
}

/// Names the values of an enumeration: `choices!(Holes { Keep: "keep", "Keep", "A chart may have holes."; … });`
macro_rules! choices {
    ($choice:ty { $($value:ident: $word:literal, $label:literal, $sentence:literal;)+ }) => {
        impl $crate::choice::Choice for $choice {
            fn all(&self) -> &'static [$crate::choice::Named] {
                const { &[$($crate::choice::Named { word: $word, label: $label, sentence: $sentence }),+] }
            }

            fn word(&self) -> &'static str {
                match self {
                    $(Self::$value => $word),+
                }
            }

            fn choose(&mut self, word: &str) -> bool {
                match word {
                    $($word => *self = Self::$value,)+
                    _ => return false,
                }
                true
            }
        }
    };
}

pub(crate) use choices;
