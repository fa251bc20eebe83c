//! The configuration as an operator sees it: `--print-config`, and refusals at startup.

use std::fs;

use serde_json::Value;

use crate::support::process::{Service, run, run_with};

/// The output of `--print-config`.
fn printed(variables: &[(&str, &str)], arguments: &[&str]) -> String {
    let arguments = [&["serve", "--print-config"], arguments].concat();
    let output = run_with(variables, &arguments, "");
    let errors = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(0), "{errors}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

fn values(text: &str) -> toml::Table {
    text.parse()
        .unwrap_or_else(|error| panic!("{error}\n{text}"))
}

#[test]
fn the_printed_configuration_names_its_sources_and_reads_back_unchanged() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = |name: &str| {
        let path = directory.path().join(name);
        path.to_str().expect("UTF-8").to_owned()
    };
    let given = "data_dir = '/var/lib/a \"b\"'\n[http]\nhead_timeout = \"250ms\"\n[limits]\npopulation = 77\n";
    fs::write(path("given.toml"), given).expect("written");
    let text = printed(
        &[
            ("NOCTULE_QUEUE", "12"),
            ("NOCTULE_CONFIG", &path("given.toml")),
        ],
        &["--grace", "0.5", "--limits-waypoints=9"],
    );
    for line in [
        "queue = 12 # NOCTULE_QUEUE",
        "grace = 0.5 # --grace",
        "listen = \"127.0.0.1:8080\" # default",
        &format!("population = 77 # {}:5", path("given.toml")),
        &format!("head_timeout = 0.25 # {}:3", path("given.toml")),
        "waypoints = 9 # --limits-waypoints",
    ] {
        assert!(text.lines().any(|found| found == line), "{line}\n{text}");
    }

    fs::write(path("printed.toml"), &text).expect("written");
    let again = printed(&[], &["--config", &path("printed.toml")]);
    assert_eq!(values(&again), values(&text));
    assert!(!again.contains("# default"), "{again}");
}

/// Even beyond the signed 64 bits that every TOML reader supports.
#[test]
fn the_greatest_count_of_a_flag_is_accepted_in_a_file_too() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let file = directory.path().join("printed.toml");
    let file = file.to_str().expect("UTF-8");
    let greatest = u64::MAX.to_string();
    let text = printed(&[], &["--retention-bytes", &greatest]);
    fs::write(file, &text).expect("written");
    let again = printed(&[], &["--config", file]);
    let line = format!("\nbytes = {greatest} #");
    assert!(again.contains(&line), "{again}");
}

#[test]
fn wrong_settings_are_refused_before_the_store_is_opened() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let file = directory.path().join("noctule.toml");
    fs::write(
        &file,
        "quue = 5\ncors_origins = ['*']\n[limits]\nthreats = \"many\"\n",
    )
    .expect("written");
    let data_dir = directory.path().join("data");
    let (file, data_dir) = (
        file.to_str().expect("UTF-8"),
        data_dir.to_str().expect("UTF-8"),
    );
    let refused = run_with(
        &[("NOCTULE_WORKERS", "-1")],
        &[
            "serve",
            "--config",
            file,
            "--data-dir",
            data_dir,
            "--grace",
            "2h",
            "--cors-origins",
            "https://plans.example",
        ],
        "",
    );
    assert_eq!(refused.status.code(), Some(1));
    assert!(refused.stdout.is_empty());
    let text = String::from_utf8(refused.stderr).expect("UTF-8");
    for part in [
        &format!("{file}:1: quue is unknown, must be one of listen, data_dir,"),
        &format!(
            "{file}:2: cors_origins is [\"*\"], must be a list of exact origins such as https://"
        ),
        &format!("{file}:4: limits.threats is \"many\", must be a whole number from 1"),
        "NOCTULE_WORKERS is \"-1\", must be a whole number from 1 to 4096",
        "--grace is \"2h\", must be seconds",
    ] {
        assert!(text.contains(part), "{part} is not in\n{text}");
    }
    assert!(
        !fs::exists(data_dir).expect("readable"),
        "the store was opened"
    );

    let missing = run(&["serve", "--config", "/nowhere.toml"], "");
    let text = String::from_utf8(missing.stderr).expect("UTF-8");
    assert!(
        text.contains("cannot read the configuration /nowhere.toml"),
        "{text}"
    );
}

/// In either spelling, the message says what the setting allows.
#[test]
fn a_negative_number_is_read_as_a_value() {
    for (arguments, expected) in [
        (
            &["--queue", "-1"][..],
            "--queue is \"-1\", must be a whole number",
        ),
        (&["--queue=-1"], "--queue is \"-1\", must be a whole number"),
        (
            &["--retention-age", "-5"],
            "--retention-age is \"-5\", must be seconds",
        ),
        (
            &["--http-head-timeout", "-0.5"],
            "--http-head-timeout is \"-0.5\", must be seconds",
        ),
    ] {
        let refused = run(&[&["serve", "--print-config"], arguments].concat(), "");
        assert_eq!(refused.status.code(), Some(1));
        let text = String::from_utf8(refused.stderr).expect("UTF-8");
        assert!(text.contains(expected), "{expected} is not in\n{text}");
    }
    let unknown = run(&["serve", "-1"], "");
    let text = String::from_utf8(unknown.stderr).expect("UTF-8");
    assert!(text.contains("unexpected argument '-1'"), "{text}");
}

/// Whoever looks for why a setting has no effect looks here first.
#[test]
fn variables_that_are_nearly_settings_are_printed() {
    let text = printed(&[("NOCTULE_WORKER", "3")], &[]);
    let told = "# the variable NOCTULE_WORKER is unknown and has no effect, did you mean NOCTULE_WORKERS?\n";
    assert!(text.starts_with(told), "{text}");
    assert_eq!(values(&text), values(&printed(&[], &[])));
}

/// They are no setting, but whoever looks at the settings wants to know.
#[test]
fn keys_in_the_environment_are_printed_as_set_and_not_shown() {
    let text = printed(&[("NOCTULE_KEYS", "hush")], &[]);
    assert!(text.starts_with("# The keys are set by NOCTULE_KEYS, and not shown\n"));
    assert!(!text.contains("hush"), "{text}");
    for none in ["", " \n"] {
        let text = printed(&[("NOCTULE_KEYS", none)], &[]);
        assert!(!text.contains("The keys are set"), "{text}");
    }
}

#[test]
fn a_shared_store_is_printed_and_credentials_in_its_address_are_never_echoed() {
    let text = printed(
        &[("NOCTULE_STORE", "nats://a:4222,b:4222/fleet")],
        &["--role=worker", "--store-replicas=3", "--store-lease=10"],
    );
    for line in [
        "store = \"nats://a:4222,b:4222/fleet\" # NOCTULE_STORE",
        "store_replicas = 3 # --store-replicas",
        "store_lease = 10 # --store-lease",
        "role = \"worker\" # --role",
    ] {
        assert!(text.lines().any(|found| found == line), "{line}\n{text}");
    }
    for (variables, arguments) in [
        (vec![("NOCTULE_STORE", "nats://me:hush@a:4222")], vec![]),
        (vec![], vec!["--store=nats://hush@a:4222"]),
    ] {
        let arguments = [vec!["serve", "--print-config"], arguments].concat();
        let refused = run_with(&variables, &arguments, "");
        assert_eq!(refused.status.code(), Some(1));
        let text = String::from_utf8(refused.stderr).expect("UTF-8");
        assert!(
            text.contains("is wrong, must be sqlite, or nats://HOST:PORT"),
            "{text}"
        );
        assert!(!text.contains("hush"), "{text}");
    }
}

#[test]
fn the_help_states_flag_variable_and_default() {
    let help = run(&["serve", "--help"], "");
    let text = String::from_utf8(help.stdout).expect("UTF-8");
    let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in [
        "--config <FILE>",
        "--queue <N> Plans that may wait; more are refused with 503 queue-full [env: NOCTULE_QUEUE] [default: 1000]",
        "--limits-body-bytes <BYTES>",
    ] {
        assert!(words.contains(part), "{part} is not in\n{text}");
    }
}

/// The configured limits are enforced and shown.
#[tokio::test]
async fn a_configured_limit_is_shown_and_enforced() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &["--limits-population", "10"]);
    let shown = service.bytes("/limits").await;
    let shown: Value = serde_json::from_slice(&shown).expect("JSON");
    assert_eq!(shown["population"], 10);
    let refused = service.post(&crate::support::scenario()).await;
    assert_eq!(refused.status(), 422);
    let problem: Value = refused.json().await.expect("JSON");
    let detail = "population is 20, must be <= 10 (limit population)";
    assert_eq!(problem["errors"][0]["detail"], detail);
}
