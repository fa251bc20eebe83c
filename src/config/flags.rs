//! The flags of `noctule serve`, made from the table of settings.

use std::path::PathBuf;

use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};

use super::Config;
use super::setting::Setting;
use super::settings;

/// The flags on the command line.
#[derive(Debug, Clone, Default)]
pub struct Flags {
    /// The file to read.
    pub config: Option<PathBuf>,
    /// Whether to only print the settings in effect.
    pub print_config: bool,
    /// Keys of settings, with their given values.
    pub(super) given: Vec<(&'static str, String)>,
}

impl Flags {
    /// No flag but the one that names the file.
    #[must_use]
    pub fn with_file(config: Option<PathBuf>) -> Self {
        Self {
            config: config.filter(|path| !path.as_os_str().is_empty()),
            ..Self::default()
        }
    }
}

/// Ids of the two flags that are not settings. No setting's key has a dash.
const CONFIG: &str = "config-file";
const PRINT_CONFIG: &str = "print-config";

impl Args for Flags {
    fn augment_args(command: Command) -> Command {
        let defaults = Config::default();
        let config = Arg::new(CONFIG)
            .long("config")
            .env("NOCTULE_CONFIG")
            .value_name("FILE")
            .value_parser(clap::value_parser!(PathBuf))
            .help("Read settings from a TOML file; flags and variables take precedence over it");
        let print = Arg::new(PRINT_CONFIG)
            .long("print-config")
            .action(ArgAction::SetTrue)
            .help("Print the settings in effect as TOML, each with its source, and exit");
        let own = settings::all()
            .into_iter()
            .map(|setting| argument(&setting, &defaults));
        command.arg(config).arg(print).args(own)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

fn argument(setting: &Setting, defaults: &Config) -> Arg {
    let default = setting.shown(defaults).map_or_else(String::new, |default| {
        format!(" [default: {}]", default.trim_matches(['"', '\'']))
    });
    let own = setting.variable();
    let variables: Vec<&str> = [own.as_str()]
        .into_iter()
        .chain(setting.shared_variable)
        .collect();
    let help = format!(
        "{} [env: {}]{default}",
        setting.help,
        variables.join(" or ")
    );
    let argument = Arg::new(setting.key)
        .long(setting.flag())
        .value_name(setting.placeholder)
        // So that the setting reports the allowed values, instead of clap reporting an unknown flag.
        .allow_negative_numbers(true)
        .help(help);
    let argument = match setting.path().0 {
        "" => argument,
        table => argument.help_heading(format!("[{table}]")),
    };
    if setting.is_switch() {
        argument
            .num_args(0..=1)
            .require_equals(true)
            .default_missing_value("true")
    } else {
        argument
    }
}

impl FromArgMatches for Flags {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let given = settings::all().into_iter().filter_map(|setting| {
            let word = matches.get_one::<String>(setting.key)?;
            Some((setting.key, word.clone()))
        });
        let config = matches.get_one::<PathBuf>(CONFIG).cloned();
        Ok(Self {
            config: config.filter(|path| !path.as_os_str().is_empty()),
            print_config: matches.get_flag(PRINT_CONFIG),
            given: given.collect(),
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}
