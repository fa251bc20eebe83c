//! Merges settings from several sources: flags override variables, variables override the file, the file overrides
//! defaults. All values must be valid, including overridden ones.

use std::ffi::OsString;
use std::fmt;
use std::path::PathBuf;

use super::setting::Setting;
use super::settings;
use super::value::{Given, refused};
use super::{Config, Flags, Role, file};

/// The settings in effect.
#[derive(Debug)]
pub struct Loaded {
    /// The settings.
    pub config: Config,
    /// Where each value comes from, in the order of the table.
    pub(super) sources: Vec<Source>,
}

/// Where a value comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Source {
    Default,
    /// The file, and the line from 1.
    File(PathBuf, usize),
    /// Name of the variable.
    Variable(String),
    /// Name of the flag, with dashes.
    Flag(String),
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Default => write!(f, "default"),
            Self::File(path, line) => write!(f, "{}:{line}", path.display()),
            Self::Variable(name) | Self::Flag(name) => write!(f, "{name}"),
        }
    }
}

/// Merge the layers. `variable` looks into the environment.
///
/// # Errors
/// Everything that is wrong, one line each: where it is, what it is, and what it must be.
pub fn load(
    flags: &Flags,
    variable: impl Fn(&str) -> Option<OsString>,
) -> Result<Loaded, Vec<String>> {
    let settings = settings::all();
    let mut layers = Layers {
        config: Config::default(),
        sources: vec![Source::Default; settings.len()],
        settings: &settings,
        faults: Vec::new(),
    };
    layers.file(flags);
    layers.environment(variable);
    layers.flags(flags);
    layers.together();
    if layers.faults.is_empty() {
        let (config, sources) = (layers.config, layers.sources);
        Ok(Loaded { config, sources })
    } else {
        Err(layers.faults)
    }
}

struct Layers<'a> {
    config: Config,
    sources: Vec<Source>,
    settings: &'a [Setting],
    faults: Vec<String>,
}

impl Layers<'_> {
    fn file(&mut self, flags: &Flags) {
        let Some(path) = &flags.config else {
            return;
        };
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) => {
                let fault = format!("cannot read the configuration {}: {error}", path.display());
                return self.faults.push(fault);
            }
        };
        let (entries, faults) = file::read(&text, self.settings);
        for fault in faults {
            let fault = format!("{}:{}: {}", path.display(), fault.line, fault.detail);
            self.faults.push(fault);
        }
        for entry in entries {
            let source = Source::File(path.clone(), entry.line);
            let place = format!("{source}: {}", entry.setting.key);
            self.put(entry.setting.key, &entry.given, source, &place);
        }
    }

    /// An empty variable counts as unset.
    fn environment(&mut self, variable: impl Fn(&str) -> Option<OsString>) {
        for setting in self.settings {
            let own = setting.variable();
            // The later one wins.
            for name in setting.shared_variable.into_iter().chain([own.as_str()]) {
                match variable(name).map(OsString::into_string) {
                    None => {}
                    Some(Ok(word)) if word.is_empty() => {}
                    Some(Ok(word)) => {
                        let source = Source::Variable(name.to_owned());
                        self.put(setting.key, &Given::Word(word), source, name);
                    }
                    Some(Err(_)) => self.faults.push(format!("{name} is not UTF-8")),
                }
            }
        }
    }

    fn flags(&mut self, flags: &Flags) {
        for (key, word) in &flags.given {
            let place = format!("--{}", self.settings[self.index(key)].flag());
            let source = Source::Flag(place.clone());
            self.put(key, &Given::Word(word.clone()), source, &place);
        }
    }

    /// Checks values that are valid on their own but not together.
    fn together(&mut self) {
        let Config { role, store, .. } = &self.config;
        if *role != Role::All && !store.is_shared() && self.faults.is_empty() {
            let place = match &self.sources[self.index("role")] {
                source @ Source::File(..) => format!("{source}: role"),
                source => source.to_string(),
            };
            let reason = match role {
                Role::Worker => "no other process could take plans for it to run",
                _ => "no other process could run its plans",
            };
            self.faults.push(format!(
                "{place} is {:?}, must be all while store is {}: {reason}; nodes share a store nats://...",
                role.name(),
                store.name()
            ));
        }
    }

    fn put(&mut self, key: &str, given: &Given, source: Source, place: &str) {
        let index = self.index(key);
        match self.settings[index].set(&mut self.config, given) {
            Ok(()) => self.sources[index] = source,
            Err(allowed) => {
                let refused = refused(given, self.settings[index].hides(given), &allowed);
                self.faults.push(format!("{place} {refused}"));
            }
        }
    }

    fn index(&self, key: &str) -> usize {
        let mut settings = self.settings.iter();
        settings
            .position(|setting| setting.key == key)
            .expect("keys come from the table")
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;
    use std::time::Duration;

    use super::*;

    /// Load with a file of these lines, these variables and these flags.
    fn loaded(
        lines: &str,
        variables: &[(&str, &str)],
        given: &[(&'static str, &str)],
    ) -> Result<Loaded, Vec<String>> {
        let mut file = tempfile::NamedTempFile::new().expect("a file");
        file.write_all(lines.as_bytes()).expect("written");
        let flags = Flags {
            config: Some(file.path().to_owned()),
            print_config: false,
            given: given
                .iter()
                .map(|(key, word)| (*key, (*word).to_owned()))
                .collect(),
        };
        let variable = |name: &str| {
            let found = variables.iter().find(|(known, _)| *known == name);
            found.map(|(_, word)| OsString::from(word))
        };
        let name = file.path().display().to_string();
        load(&flags, variable).map_err(|faults| {
            let faults = faults.into_iter();
            faults.map(|fault| fault.replace(&name, "FILE")).collect()
        })
    }

    #[test]
    fn flags_count_before_variables_before_the_file_before_defaults() {
        let lines = "queue = 3\nworkers = 3\ngrace = 3\n[limits]\nthreats = 3\n";
        let variables = [
            ("NOCTULE_QUEUE", "2"),
            ("NOCTULE_WORKERS", "2"),
            ("NOCTULE_LIMITS_PEAKS", ""),
        ];
        let loaded = loaded(lines, &variables, &[("queue", "1")]).expect("right");
        let config = &loaded.config;
        assert_eq!((config.queue, config.workers), (1, 2));
        assert_eq!(config.grace, Duration::from_secs(3));
        assert_eq!(config.limits.threats, 3);
        assert_eq!(config.limits.peaks, Config::default().limits.peaks);
        let source = |key: &str| {
            let index = settings::all()
                .iter()
                .position(|setting| setting.key == key);
            loaded.sources[index.expect("known")].clone()
        };
        assert_eq!(source("queue"), Source::Flag("--queue".to_owned()));
        assert_eq!(
            source("workers"),
            Source::Variable("NOCTULE_WORKERS".to_owned())
        );
        assert!(matches!(source("grace"), Source::File(_, 3)));
        assert!(matches!(source("limits.threats"), Source::File(_, 5)));
        assert_eq!(source("limits.peaks"), Source::Default);
    }

    #[test]
    fn everything_that_is_wrong_is_told_at_once_with_its_place() {
        let lines = "workers = 0\nwokers = 2\nlimits = 3\n[http]\nhead_timeout = \"soon\"\nheads = 1\n[htpp]\n";
        let variables = [("NOCTULE_QUEUE", "many")];
        let faults = loaded(lines, &variables, &[("log_format", "xml")]).expect_err("wrong");
        // Stops before the lists of names that grow with the settings.
        let expected = [
            "FILE:2: wokers is unknown, must be one of listen, data_dir, terrain_dir, workers, queue, ",
            "FILE:3: limits must be a table with body_bytes, threats, ",
            "FILE:6: http.heads is unknown, must be one of head_timeout, body_timeout, ",
            "FILE:7: htpp is unknown, must be one of listen, data_dir, terrain_dir, workers, queue, ",
            "FILE:1: workers is 0, must be a whole number from 1 to 4096",
            "FILE:5: http.head_timeout is \"soon\", must be seconds, or a number with a unit such as 250ms, 30s, 15m, 12h or 30d, from 0.1 to 3600",
            "NOCTULE_QUEUE is \"many\", must be a whole number from 1 to 100000000",
            "--log-format is \"xml\", must be text or json",
        ];
        assert_eq!(faults.len(), expected.len(), "{faults:#?}");
        for (fault, expected) in faults.iter().zip(expected) {
            assert!(fault.starts_with(expected), "{fault} is not {expected}");
        }
        assert!(
            faults[0].contains(", http, "),
            "tables are among the names: {}",
            faults[0]
        );
    }

    #[test]
    fn a_file_that_is_no_toml_is_refused_with_the_line() {
        let faults = loaded("queue = 3\nqueue = = 4\n", &[], &[]).expect_err("wrong");
        assert!(faults[0].starts_with("FILE:2: "), "{faults:?}");
        let faults = loaded("queue = 3\nqueue = 4\n", &[], &[]).expect_err("wrong");
        assert_eq!(faults, ["FILE:2: duplicate key"]);
    }

    #[test]
    fn a_secret_is_never_shown() {
        let secret = [("NOCTULE_OTLP_HEADERS", "authorization=hush")];
        let loaded_secret = loaded("", &secret, &[]).expect("right");
        let mut printed = Vec::new();
        loaded_secret.write_toml(&mut printed).expect("written");
        let printed = String::from_utf8(printed).expect("UTF-8");
        let line = "# otlp_headers is set by NOCTULE_OTLP_HEADERS, and not shown";
        assert!(printed.lines().any(|found| found == line), "{printed}");
        assert!(!printed.contains("hush"), "{printed}");
        assert!(!format!("{loaded_secret:?}").contains("hush"));
        let faults = loaded("otlp_headers = \"hush\"\n", &[], &[]).expect_err("wrong");
        assert!(faults[0].starts_with("FILE:1: otlp_headers is wrong, must be name=value"));
        assert!(!faults[0].contains("hush"), "{faults:?}");
    }

    #[test]
    fn a_password_in_an_address_is_refused_unshown() {
        for text in ["nats://user:hush@a:4222", "user:hush@a"] {
            let faults = loaded("", &[("NOCTULE_STORE", text)], &[]).expect_err("wrong");
            let expected = "NOCTULE_STORE is wrong, must be sqlite, or nats://HOST:PORT or tls://HOST:PORT \
                without user and password (store_credentials has those)";
            assert!(faults[0].starts_with(expected), "{faults:?}");
            assert!(!faults[0].contains("hush"), "{faults:?}");
        }
    }

    #[test]
    fn a_part_is_played_where_nodes_share_a_store() {
        let check = |lines: &str, given: &[(&'static str, &str)], expected: &str| {
            let faults = loaded(lines, &[], given).expect_err("wrong");
            assert_eq!(faults, [expected]);
        };
        check(
            "role = \"worker\"\n",
            &[],
            "FILE:1: role is \"worker\", must be all while store is sqlite: no other process could take plans for \
             it to run; nodes share a store nats://...",
        );
        check(
            "",
            &[("role", "api")],
            "--role is \"api\", must be all while store is sqlite: no other process could run its plans; nodes \
             share a store nats://...",
        );
        for (name, role) in [
            ("all", Role::All),
            ("api", Role::Api),
            ("worker", Role::Worker),
        ] {
            let given = [("store", "nats://a:4222"), ("role", name)];
            let config = loaded("", &[], &given).expect("right").config;
            assert_eq!(config.role, role);
        }
    }

    #[test]
    fn numbers_may_be_written_in_every_way_of_toml() {
        let lines = "queue = 1_000\n[limits]\nwork = 0xff\n";
        let config = loaded(lines, &[], &[]).expect("right").config;
        assert_eq!((config.queue, config.limits.work), (1000, 255));
    }
}
