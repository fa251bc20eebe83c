//! The file name of what is downloaded of a plan.

/// Most characters of a scenario's name used in a file name.
const LONGEST: usize = 60;

/// The scenario's name in portable characters, a suffix that distinguishes the plan, and an `ending`: what it is of the
/// plan, and the extension.
#[must_use]
pub fn file_name(scenario: Option<&str>, plan: Option<&str>, ending: &str) -> String {
    let name = slug(scenario.unwrap_or_default());
    let name = if name.is_empty() { "plan" } else { &name };
    whole(name, plan, ending)
}

/// The same with the letters of every script, where the scenario's name has others than those of ASCII.
#[must_use]
pub fn file_name_in_full(
    scenario: Option<&str>,
    plan: Option<&str>,
    ending: &str,
) -> Option<String> {
    let name = words(scenario?, char::is_alphanumeric);
    (!name.is_ascii()).then(|| whole(&name, plan, ending))
}

fn whole(name: &str, plan: Option<&str>, ending: &str) -> String {
    // The end of an id is its random part.
    let tail = plan.map(|id| format!("-{}", id.get(id.len().saturating_sub(8)..).unwrap_or(id)));
    format!("{name}{}{ending}", tail.unwrap_or_default())
}

/// Lower-case ASCII letters and digits, hyphens between.
fn slug(name: &str) -> String {
    words(name, |letter| letter.is_ascii_alphanumeric())
}

/// The words of a name, of letters that are `kept`, in lower case with hyphens between.
fn words(name: &str, kept: impl Fn(char) -> bool) -> String {
    let words: Vec<String> = name
        .split(|letter: char| !kept(letter))
        .filter(|word| !word.is_empty())
        .map(str::to_lowercase)
        .collect();
    let begin: String = words.join("-").chars().take(LONGEST).collect();
    begin.trim_end_matches('-').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_safe_everywhere() {
        let id = Some("01936f2c-7d1a-7c55-9a53-27b1b44c1a10");
        for (name, id, expected) in [
            (Some("Ridge run, 2"), id, "ridge-run-2-b44c1a10.kml"),
            (Some("../../etc/passwd\r\n\""), None, "etc-passwd.kml"),
            (Some("Übung ☂"), id, "bung-b44c1a10.kml"),
            (Some("☂"), None, "plan.kml"),
            (None, id, "plan-b44c1a10.kml"),
        ] {
            assert_eq!(file_name(name, id, ".kml"), expected);
        }
        assert_eq!(
            file_name(Some(&"ab ".repeat(50)), None, ".kml").len(),
            60 + 3
        );
    }

    #[test]
    fn names_in_other_scripts_are_whole() {
        let id = Some("01936f2c-7d1a-7c55-9a53-27b1b44c1a10");
        for (name, expected) in [
            (Some("Ridge run, 2"), None),
            (Some("Übung ☂ 2"), Some("übung-2-b44c1a10.kml")),
            (Some("巡检 路线/1"), Some("巡检-路线-1-b44c1a10.kml")),
            (Some("☂"), None),
            (None, None),
        ] {
            assert_eq!(file_name_in_full(name, id, ".kml").as_deref(), expected);
        }
    }
}
