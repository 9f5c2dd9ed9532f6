//! What the user is told where a texel density that was asked for does not fit.

use std::fmt;

use super::tile::Tile;

/// A texel density that was asked for and does not fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shortfall {
    /// What was asked for, in texels to a unit of length.
    pub(crate) wanted: f64,
    /// The densest placement that was found.
    pub(crate) reached: f64,
    /// How many tiles there were for it.
    pub(crate) tiles: usize,
    /// How many tiles would do, if they could be filled as well as those that there are, which does not hold where charts become as large as tiles; `None` where one chart alone is too large for a tile, so that no number does.
    pub(crate) needed: Option<usize>,
}

impl fmt::Display for Shortfall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { wanted, reached, tiles, needed } = *self;
        let within = if tiles == 1 { "one tile".to_owned() } else { format!("{tiles} tiles") };
        write!(f, "a texel density of {wanted} does not fit into {within}; ")?;
        write!(f, "{reached:.4} texels to a unit of length is the most that was found: ")?;
        match needed {
            None => f.write_str(
                "one chart is larger than a tile at that density, so choose a larger texture or a lower density",
            ),
            Some(needed) if needed <= Tile::MOST => {
                write!(f, "allow {needed} tiles or more, or choose a larger texture or a lower density")
            }
            Some(needed) => write!(
                f,
                "{needed} tiles or more would be needed, and there are at most {}, so choose a larger texture or a lower density",
                Tile::MOST
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_remedy_is_one_that_can_be_had() {
        let text = |tiles, needed| Shortfall { wanted: 512.0, reached: 300.25, tiles, needed }.to_string();
        assert!(
            text(1, Some(4)).contains("one tile; 300.2500 texels")
                && text(1, Some(4)).contains("allow 4 tiles or more")
        );
        assert!(text(4, Some(5000)).contains("into 4 tiles") && text(4, Some(5000)).contains("at most 100"));
        assert!(text(4, None).contains("larger than a tile") && !text(4, None).contains("allow"));
    }
}
