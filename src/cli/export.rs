//! `noctule export`: a result that was kept as JSON in another format.

use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::Args;
use serde::Deserialize;

use super::exit;
use super::files::{self, Choice};
use super::ground::Ground;
use crate::digest::sha256_hex;
use crate::export::{ExportError, ResultInput};
use crate::scenario::json::{self, Rules, Unread};
use crate::scenario::limits::Limits;

#[derive(Args)]
pub(super) struct Arguments {
    /// Result document, as written by plan or the service, or - for standard input
    result: PathBuf,
    /// The scenario that the result was planned for: the file given to plan, or the answer of
    /// GET /plans/{id}/scenario; it must have the hash that the result names
    #[arg(long, value_name = "FILE")]
    scenario: PathBuf,
    /// File to write [default: standard output]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    choice: Choice,
    #[command(flatten)]
    ground: Ground,
}

/// What a result says about its scenario.
#[derive(Deserialize)]
struct Origin {
    seed: u64,
    scenario_sha256: String,
}

/// Write the result; the exit code tells why it could not be written.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<u8> {
    let chosen = arguments.choice.of(arguments.out.as_deref().as_slice())?;
    let [chosen] = chosen.as_slice() else {
        unreachable!("one file has one format");
    };
    if [&arguments.result, &arguments.scenario]
        .iter()
        .all(|file| **file == Path::new("-"))
    {
        bail!("the result and the scenario cannot both be standard input");
    }
    let result = files::read(&arguments.result)?;
    let scenario = files::read(&arguments.scenario)?;
    let rules = arguments.ground.rules(Limits::NONE)?;
    let (result, scenario) = match pair(&result, &scenario, &rules) {
        Ok(pair) => pair,
        Err(Amiss::Result(why)) => {
            eprintln!("{}: {why}", arguments.result.display());
            return Ok(exit::BAD_INPUT);
        }
        Err(Amiss::Scenario(why)) => {
            eprintln!("{}: {why}", arguments.scenario.display());
            return Ok(exit::BAD_INPUT);
        }
    };
    let input = ResultInput {
        result: &result,
        scenario: &scenario,
        rules: &rules,
    };
    match chosen.format.write(&input, &chosen.options) {
        Ok(document) => {
            files::write(arguments.out.as_deref(), &document)?;
            Ok(exit::DONE)
        }
        Err(error) => {
            eprintln!("{}: {error}", arguments.result.display());
            Ok(code(&error))
        }
    }
}

/// The exit code for a plan that cannot be exported.
pub(super) fn code(error: &ExportError) -> u8 {
    match error {
        ExportError::Infeasible { .. } => exit::INFEASIBLE,
        ExportError::Option(_) | ExportError::Unread(Unread::Unreachable(_)) => exit::FAILED,
        ExportError::NoGeodeticFrame { .. }
        | ExportError::Unflyable(_)
        | ExportError::Unread(Unread::NoGround(_) | Unread::Damaged(_))
        | ExportError::Damaged(_) => exit::BAD_INPUT,
    }
}

/// Which of the two documents cannot be used, and why.
enum Amiss {
    Result(String),
    Scenario(String),
}

/// Both documents as text, the scenario as it was accepted.
fn pair(result: &[u8], scenario: &[u8], rules: &Rules) -> Result<(String, String), Amiss> {
    let result =
        String::from_utf8(result.to_vec()).map_err(|error| Amiss::Result(error.to_string()))?;
    let origin: Origin = serde_json::from_str(&result)
        .map_err(|error| Amiss::Result(format!("no result document: {error}")))?;
    // A scenario without a seed was planned with the one in the result.
    let scenario = json::read(scenario, rules, origin.seed)
        .map_err(|refusal| Amiss::Scenario(format!("the scenario is refused: {refusal}")))?;
    let accepted = json::write(&scenario);
    if sha256_hex(accepted.as_bytes()) == origin.scenario_sha256 {
        return Ok((result, accepted));
    }
    let why = "the scenario is not the one that the result was planned for";
    Err(Amiss::Scenario(why.to_owned()))
}
