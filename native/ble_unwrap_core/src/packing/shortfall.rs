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
    /// How many tiles would do if they could be filled as well as those that there are; where charts are nearly as large as tiles, it takes more.
    /// `None` where one chart alone is too large for a tile, so that no number does.
    pub(crate) needed: Option<usize>,
}

impl fmt::Display for Shortfall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { wanted, reached, tiles, needed } = *self;
        let within = if tiles == 1 { "one tile".to_owned() } else { format!("{tiles} tiles") };
        let [wanted, reached] = [wanted, reached].map(significant);
        write!(f, "a texel density of {wanted} does not fit into {within}; ")?;
        write!(f, "{reached} texels to a unit of length is the most that was found; ")?;
        match needed {
            None => f.write_str(
                "one chart is larger than a tile at the density asked for, so choose a larger texture or a lower density",
            ),
            Some(needed) if needed <= Tile::MOST => {
                write!(f, "allow {needed} tiles or more, or choose a larger texture or a lower density")
            }
            Some(_) => write!(f, "even {} tiles would not do, so choose a larger texture or a lower density", Tile::MOST),
        }
    }
}

/// A positive number with four digits that count, or more before the point, and without an exponent.
fn significant(x: f64) -> String {
    let decimals = (3.0 - x.log10().floor()).clamp(0.0, 12.0);
    let text = format!("{x:.*}", decimals as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_remedy_is_one_that_can_be_had() {
        let text = |tiles, needed| Shortfall { wanted: 512.0, reached: 300.25, tiles, needed }.to_string();
        assert!(
            text(1, Some(4)).contains("one tile; 300.2 texels") && text(1, Some(4)).contains("allow 4 tiles or more")
        );
        assert!(text(4, Some(5000)).contains("into 4 tiles") && text(4, Some(5000)).contains("even 100 tiles"));
        assert!(text(4, None).contains("larger than a tile") && !text(4, None).contains("allow"));
    }

    #[test]
    fn numbers_have_four_digits_that_count() {
        let shown = [10.239_999_771_118_164, 512.0, 12_345.6, 0.000_123_456, 1e300].map(significant);
        assert_eq!(shown[..4], ["10.24", "512", "12346", "0.0001235"]);
        assert!(shown[4].starts_with('1') && significant(f64::MIN_POSITIVE) == "0");
    }
}
