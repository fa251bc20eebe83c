//! What a key may do, and what a route may require.

/// What a key may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// Read and follow one's own plans.
    Read,
    /// Submit, cancel and delete plans as well.
    Plan,
    /// Read the metrics.
    Metrics,
    /// Everything, with everybody's plans.
    Admin,
}

impl Scope {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Read, Self::Plan, Self::Metrics, Self::Admin];

    /// Its name in the file of keys.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Plan => "plan",
            Self::Metrics => "metrics",
            Self::Admin => "admin",
        }
    }

    /// The scope with this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|scope| scope.name() == name)
    }

    /// Whether this scope includes what `other` allows.
    #[must_use]
    pub fn includes(self, other: Self) -> bool {
        self == other || self == Self::Admin || (self, other) == (Self::Plan, Self::Read)
    }
}

/// What a route requires of its caller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// No key.
    Nothing,
    /// A key with this scope.
    Scope(Scope),
    /// A key with [`Scope::Read`], or a ticket for the plan.
    Ticket,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn admin_includes_every_scope_and_plan_includes_read() {
        for (has, asked, may) in [
            (Scope::Read, Scope::Read, true),
            (Scope::Read, Scope::Plan, false),
            (Scope::Plan, Scope::Read, true),
            (Scope::Plan, Scope::Metrics, false),
            (Scope::Plan, Scope::Admin, false),
            (Scope::Metrics, Scope::Read, false),
            (Scope::Admin, Scope::Metrics, true),
            (Scope::Admin, Scope::Plan, true),
        ] {
            assert_eq!(has.includes(asked), may, "{has:?} for {asked:?}");
        }
    }
}
