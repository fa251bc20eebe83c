//! `noctule serve --print-config`: what is in effect, as a file that says the same.

use std::fmt::Write as _;

use super::layers::Loaded;
use super::settings;

impl Loaded {
    /// TOML, with what each setting is and where its value comes from in comments.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut text = String::new();
        self.write(&mut text)
            .expect("writing to a string cannot fail");
        text
    }

    fn write(&self, text: &mut String) -> std::fmt::Result {
        let mut table = "";
        for (setting, source) in settings::all().iter().zip(&self.sources) {
            let (its_table, key) = setting.path();
            if its_table != table {
                table = its_table;
                writeln!(text, "\n[{table}]")?;
            }
            writeln!(text, "# {}", setting.help)?;
            match setting.shown(&self.config) {
                Some(value) => writeln!(text, "{key} = {value} # {source}")?,
                None => writeln!(text, "# {key} is not set")?,
            }
        }
        Ok(())
    }
}
