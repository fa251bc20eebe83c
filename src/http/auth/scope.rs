//! What a key may do, and what each route requires.

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

impl Needs {
    /// For the route with this method and path. Unlisted routes require more rather than less.
    pub(in crate::http) fn of(method: &str, path: &str) -> Self {
        match (method, path) {
            (
                "GET",
                "/"
                | "/algorithms"
                | "/docs"
                | "/limits"
                | "/livez"
                | "/openapi.json"
                | "/openapi.yaml"
                | "/page/{file}"
                | "/page/vendor/{file}"
                | "/problems/{slug}"
                | "/readyz"
                | "/scenarios"
                | "/scenarios/{name}"
                | "/version",
            ) => Self::Nothing,
            ("GET", "/metrics") => Self::Scope(Scope::Metrics),
            ("GET", "/plans/{id}/events") => Self::Ticket,
            ("GET", _) | ("POST", "/plans/{id}/tickets") => Self::Scope(Scope::Read),
            (_, path) if path.starts_with("/plans") => Self::Scope(Scope::Plan),
            // The handler decides who may change a dataset.
            ("PUT" | "DELETE", "/terrains/{name}")
            | ("POST", "/scenarios:convert" | "/scenarios:ground") => Self::Scope(Scope::Plan),
            _ => Self::Scope(Scope::Admin),
        }
    }
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

    #[test]
    fn unlisted_routes_need_the_stricter_scope() {
        for (method, path, needs) in [
            ("GET", "/livez", Needs::Nothing),
            ("GET", "/plans", Needs::Scope(Scope::Read)),
            ("GET", "/something/new", Needs::Scope(Scope::Read)),
            ("POST", "/plans", Needs::Scope(Scope::Plan)),
            ("DELETE", "/plans/{id}", Needs::Scope(Scope::Plan)),
            ("PUT", "/terrains/{name}", Needs::Scope(Scope::Plan)),
            ("PUT", "/something/new", Needs::Scope(Scope::Admin)),
            ("POST", "/livez", Needs::Scope(Scope::Admin)),
        ] {
            assert_eq!(Needs::of(method, path), needs, "{method} {path}");
        }
    }
}
