//! `noctule convert`: other programs' files as scenarios.

use std::path::PathBuf;

use clap::Args;

use super::exit;
use super::files;
use crate::import::{self, ImportError, Most, Syntax, Unused};
use crate::scenario::limits::Limits;

#[derive(Args)]
pub(super) struct Arguments {
    /// GeoJSON, KML or QGroundControl plan, or - for standard input
    file: PathBuf,
    /// File for the scenario [default: standard output]
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Write the scenario; assumptions and unused parts are reported on standard error.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<u8> {
    let text = files::read(&arguments.file)?;
    let file = arguments.file.display();
    let limits = Limits::default();
    let most = Most {
        threats: limits.threats,
        polygon_vertices: limits.polygon_vertices,
    };
    match import::convert(&text, Syntax::of(&text), most) {
        Ok(conversion) => {
            for assumed in &conversion.assumed {
                eprintln!("assumed {}: {}", assumed.pointer, assumed.reason);
            }
            tell(&conversion.unused);
            files::write(
                arguments.out.as_deref(),
                &format!("{:#}", conversion.scenario),
            )?;
            Ok(exit::DONE)
        }
        Err(error) => {
            if let ImportError::NoScenario { unused, .. } = &error {
                tell(unused);
            }
            eprintln!("{file}: {error}");
            Ok(exit::BAD_INPUT)
        }
    }
}

fn tell(unused: &[Unused]) {
    for Unused { place, reason } in unused {
        eprintln!("not used {place}: {reason}");
    }
}
