//! `noctule convert`: other programs' files as scenarios.

use std::path::PathBuf;

use clap::Args;

use super::exit;
use super::files;
use crate::import::{self, End, Flight, ImportError, Most, Syntax, Unused, WITHIN_M};
use crate::scenario::limits::Limits;

#[derive(Args)]
pub(super) struct Arguments {
    /// GeoJSON, KML, QGroundControl plan or map of airspace (OpenAir, ED-269, ED-318), or - for standard input
    file: PathBuf,
    /// Where the flight begins, degrees and metres; maps of airspace do not say
    #[arg(long, value_name = "LAT,LON[,ALT]", allow_hyphen_values = true)]
    start: Option<End>,
    /// Where the flight ends
    #[arg(long, value_name = "LAT,LON[,ALT]", allow_hyphen_values = true)]
    target: Option<End>,
    /// How far beyond start and target threats are kept and the route may lead, metres [default: half of the way between
    /// them, at least 1000]
    #[arg(long, value_name = "METRES", requires_all = ["start", "target"], value_parser = within)]
    within: Option<f64>,
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
    let flight = Flight {
        start: arguments.start,
        target: arguments.target,
        within_m: arguments.within,
    };
    match import::convert(&text, Syntax::of(&text), most, &flight) {
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

/// Say for each reason what is not used for it, the first few by name.
fn tell(unused: &[Unused]) {
    const NAMED: usize = 3;
    let mut told: Vec<(&str, Vec<&str>)> = Vec::new();
    for Unused { place, reason } in unused {
        match told.iter_mut().find(|(known, _)| known == reason) {
            Some((_, places)) => places.push(place),
            None => told.push((reason, vec![place])),
        }
    }
    for (reason, places) in told {
        let (named, more) = places.split_at(places.len().min(NAMED));
        let named = named.join(", ");
        match more.len() {
            0 => eprintln!("not used {named}: {reason}"),
            more => eprintln!("not used {named} and {more} more: {reason}"),
        }
    }
}

fn within(text: &str) -> Result<f64, String> {
    let read = text.parse().ok().filter(|metres| WITHIN_M.contains(metres));
    read.ok_or_else(|| {
        let (least, most) = (WITHIN_M.start(), WITHIN_M.end());
        format!("must be metres from {least} to {most}")
    })
}
