//! A shelf in memory that can fail or be interrupted at any step.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::io::{self, Write};

use parking_lot::Mutex;

use crate::catalogue::{Change, Changes, Shelf, Source};

/// A shelf in memory.
#[derive(Default)]
pub(super) struct Memory(Mutex<State>);

#[derive(Default)]
struct State {
    revision: u64,
    keys: BTreeMap<String, (Option<String>, u64)>,
    /// Bytes, and whether the file is complete.
    files: BTreeMap<String, (Vec<u8>, bool)>,
    /// Calls so far.
    calls: usize,
    trouble: Option<(usize, Trouble)>,
    away: bool,
}

/// What goes wrong at a call.
pub(super) enum Trouble {
    /// It fails and has done nothing, or half of it.
    FailsBefore,
    /// It fails after doing everything.
    FailsAfter,
    /// Something else happens first.
    Interrupted(Box<dyn FnOnce() + Send>),
}

impl Memory {
    /// Cause trouble at the call after `calls` more.
    pub(super) fn trouble_in(&self, calls: usize, trouble: Trouble) {
        let mut state = self.0.lock();
        state.trouble = Some((state.calls + calls, trouble));
    }

    /// Cancel the trouble; returns whether it had not happened yet.
    pub(super) fn calm(&self) -> bool {
        self.0.lock().trouble.take().is_some()
    }

    /// Make the shelf unreachable, or reachable again.
    pub(super) fn be_away(&self, away: bool) {
        self.0.lock().away = away;
    }

    /// Number of complete and of incomplete files.
    pub(super) fn counts(&self) -> [usize; 2] {
        let state = self.0.lock();
        let whole = state.files.values().filter(|(_, whole)| *whole).count();
        [whole, state.files.len() - whole]
    }

    /// Write a value that no catalogue would write.
    pub(super) fn scribble(&self, key: &str, value: &str) {
        let expected = self.0.lock().keys.get(key).map_or(0, |written| written.1);
        let written = self.write(key, value, expected);
        written
            .expect("it can be reached")
            .expect("it is as it was");
    }

    fn call<T>(&self, work: impl FnOnce(&mut State, bool) -> io::Result<T>) -> io::Result<T> {
        let mut state = self.0.lock();
        state.calls += 1;
        let due = matches!(state.trouble, Some((call, _)) if call < state.calls);
        let trouble = if due { state.trouble.take() } else { None };
        if state.away {
            return Err(io::Error::other("away"));
        }
        match trouble {
            None => work(&mut state, true),
            Some((_, Trouble::FailsBefore)) => {
                let _ = work(&mut state, false);
                Err(io::Error::other("failed"))
            }
            Some((_, Trouble::FailsAfter)) => {
                work(&mut state, true)?;
                Err(io::Error::other("no answer"))
            }
            Some((_, Trouble::Interrupted(meanwhile))) => {
                drop(state);
                meanwhile();
                work(&mut self.0.lock(), true)
            }
        }
    }
}

impl State {
    fn write(
        &mut self,
        key: &str,
        value: Option<&str>,
        expected: u64,
        wholly: bool,
    ) -> Option<u64> {
        let written = self.keys.get(key).map_or(0, |written| written.1);
        if written != expected || !wholly {
            return None;
        }
        self.revision += 1;
        let record = (value.map(str::to_owned), self.revision);
        self.keys.insert(key.to_owned(), record);
        Some(self.revision)
    }
}

impl fmt::Debug for Memory {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("a shelf in memory")
    }
}

impl Shelf for Memory {
    fn changes(&self, after: u64) -> io::Result<Changes> {
        self.call(|state, _| {
            let keys = state.keys.iter().filter(|(_, written)| written.1 > after);
            let mut changes: Vec<Change> = keys
                .map(|(key, (value, revision))| Change {
                    key: key.clone(),
                    value: value.clone(),
                    revision: *revision,
                })
                .collect();
            changes.sort_by_key(|change| change.revision);
            Ok(Changes {
                revision: state.revision,
                changes,
            })
        })
    }

    fn write(&self, key: &str, value: &str, expected: u64) -> io::Result<Option<u64>> {
        self.call(|state, wholly| Ok(state.write(key, Some(value), expected, wholly)))
    }

    fn erase(&self, key: &str, expected: u64) -> io::Result<bool> {
        self.call(|state, wholly| Ok(state.write(key, None, expected, wholly).is_some()))
    }

    fn put(&self, file: &mut dyn Source) -> io::Result<String> {
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        self.call(|state, wholly| {
            let name = format!("file-{}", state.calls);
            if !wholly {
                bytes.truncate(bytes.len() / 2);
            }
            state.files.insert(name.clone(), (bytes, wholly));
            Ok(name)
        })
    }

    fn fetch(&self, file: &str, to: &mut dyn Write) -> io::Result<bool> {
        self.call(|state, wholly| {
            let Some((bytes, true)) = state.files.get(file) else {
                return Ok(false);
            };
            let length = if wholly { bytes.len() } else { bytes.len() / 2 };
            to.write_all(&bytes[..length])?;
            Ok(true)
        })
    }

    fn files(&self) -> io::Result<BTreeSet<String>> {
        self.call(|state, _| Ok(state.files.keys().cloned().collect()))
    }

    fn discard(&self, file: &str) -> io::Result<()> {
        self.call(|state, wholly| {
            if wholly {
                state.files.remove(file);
            }
            Ok(())
        })
    }
}
