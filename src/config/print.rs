//! `noctule serve --print-config`: the settings in effect, as an equivalent file.

use std::io::Write;

use super::layers::Loaded;
use super::settings;

impl Loaded {
    /// TOML, with what each setting is and where its value comes from in comments.
    ///
    /// # Errors
    /// When `out` fails.
    pub fn write_toml(&self, out: &mut impl Write) -> std::io::Result<()> {
        let mut table = "";
        for (setting, source) in settings::all().iter().zip(&self.sources) {
            let (its_table, key) = setting.path();
            if its_table != table {
                table = its_table;
                writeln!(out, "\n[{table}]")?;
            }
            writeln!(out, "# {}", setting.help)?;
            match setting.shown(&self.config) {
                Some(_) if setting.is_secret() => {
                    writeln!(out, "# {key} is set by {source}, and not shown")?;
                }
                Some(value) => writeln!(out, "{key} = {value} # {source}")?,
                None => writeln!(out, "# {key} is not set")?,
            }
        }
        Ok(())
    }
}
