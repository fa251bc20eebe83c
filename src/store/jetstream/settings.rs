//! Where the servers are, and what is required of them.

use std::path::PathBuf;
use std::time::Duration;

use crate::config::Address;

/// How the service is stored in a NATS system.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings {
    /// Address of one or more servers of one system.
    pub address: Address,
    /// A file with the user's credentials, as `nsc` writes it.
    pub credentials: Option<PathBuf>,
    /// Copies that the servers keep of everything: 1, 3 or 5.
    pub replicas: usize,
    /// How long a run belongs to this node after its last renewal.
    pub lease: Duration,
    /// Plans that this node runs at a time; 0 for a node that only serves.
    pub slots: usize,
}
