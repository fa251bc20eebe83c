//! Environment variables that look like those of settings and are none: a value that would have no effect unnoticed.
//!
//! They are told, not refused: where containers are orchestrated, a service by the name of this one defines variables
//! such as `NOCTULE_PORT_8080_TCP` for all others.

use super::settings;
use crate::scenario::json;

/// Variables of the program that are no settings.
const OTHERS: [&str; 3] = ["NOCTULE_CONFIG", "NOCTULE_HEALTHCHECK_URL", "NOCTULE_KEYS"];

/// A line about each of the `variables` that is nearly the name of one that the program reads.
pub fn misspelt(variables: impl IntoIterator<Item = String>) -> Vec<String> {
    let own: Vec<String> = settings::all()
        .iter()
        .map(super::setting::Setting::variable)
        .collect();
    let known: Vec<&str> = own.iter().map(String::as_str).chain(OTHERS).collect();
    let ours = variables
        .into_iter()
        .filter(|name| name.starts_with("NOCTULE_"));
    let line = |name: String| {
        let hint = json::hint(&name, &known);
        let is_near = !known.contains(&name.as_str()) && !hint.is_empty();
        let name = name.escape_debug();
        is_near.then(|| format!("the variable {name} is unknown and has no effect{hint}"))
    };
    ours.filter_map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variables_that_are_nearly_those_of_settings_are_told() {
        let names = [
            "NOCTULE_WORKER",
            "NOCTULE_HTTP_MAX_CONECTIONS",
            "NOCTULE_KEY_FILE",
            "NOCTULE_KEYS",
            "NOCTULE_CONFIG",
            "NOCTULE_QUEUE",
            "NOCTULE_PORT",
            "NOCTULE_PORT_8080_TCP",
            "NOCTULE_SERVICE_HOST",
            "WORKERS",
        ];
        assert_eq!(
            misspelt(names.map(str::to_owned)),
            [
                "the variable NOCTULE_WORKER is unknown and has no effect, did you mean NOCTULE_WORKERS?",
                "the variable NOCTULE_HTTP_MAX_CONECTIONS is unknown and has no effect, did you mean \
                 NOCTULE_HTTP_MAX_CONNECTIONS?",
                "the variable NOCTULE_KEY_FILE is unknown and has no effect, did you mean NOCTULE_KEYS_FILE?",
            ]
        );
    }
}
