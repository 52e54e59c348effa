//! Declarations of families and of their members: what each kind would else write again.

/// The public functions of a family: `all`, `join` and `read`. Behind its members may stand an iterator of more. Attributes are those of `join`.
macro_rules! family {
    ($(#[$join:meta])* $what:literal: $T:ty = [$($entry:expr),* $(,)?] $(+ $more:expr)?) => {
        static JOINED: $crate::registry::Joined<$T> = $crate::registry::Joined::new();

        fn built_in() -> Vec<$crate::registry::Entry<$T>> {
            [$($entry),*].into_iter()$(.chain($more))?.collect()
        }

        #[doc = concat!("Every ", $what, " that a config can name.")]
        pub fn all() -> Vec<$crate::registry::Entry<$T>> {
            JOINED.after(built_in())
        }

        #[doc = concat!("Adds a ", $what, " of a program's own to [`all`].")]
        $(#[$join])*
        ///
        /// # Errors
        /// If one of that kind is there.
        pub fn join(
            entry: $crate::registry::Entry<$T>,
        ) -> Result<(), $crate::registry::Taken> {
            JOINED.add(built_in(), entry)
        }

        #[doc = concat!("Reads a ", $what, " from its config table.")]
        pub fn read(
            table: $crate::registry::Table<'_>,
        ) -> Result<Box<$T>, $crate::registry::ReadError> {
            $crate::registry::read($what, &all(), table)
        }
    };
}

/// The keys of a table, each with its type, its default and the range that it must be in:
///
/// ```text
/// keys! {
///     /// Sheen, as a config writes it.
///     pub struct SheenSpec(channels: &Channels) {
///         /// Scale of the rim.
///         rho: Spectrum = Spectrum::Grey(1.0), in 0.0..=1.0;
///         /// Roughness of the fibres.
///         alpha: f64 = 0.3, in 1e-3..=1.0;
///     }
/// }
/// ```
///
/// A struct that names a scene, here `channels`, checks its keys by their method `within`, which a trait gives to the types
/// of keys: `check_keys` calls it in order. A range that depends on other keys is checked by a function of the struct, `check` in
/// the place of `in`.
macro_rules! keys {
    (
        $(#[$about:meta])*
        $vis:vis struct $Name:ident($scene:ident: $Scene:ty) {
            $($(#[$attribute:meta])* $key:ident: $type:ty = $default:expr $(, in $range:expr)? $(, check $check:expr)?;)*
        }
    ) => {
        $crate::registry::keys! {
            $(#[$about])*
            $vis struct $Name {
                $(
                    $(#[$attribute])*
                    $(#[doc = concat!("\n\nAllowed: `", stringify!($range), "`.")])?
                    $key: $type = $default;
                )*
            }
        }

        impl $Name {
            /// Checks each key against its range.
            ///
            /// # Errors
            /// Names the first that is outside.
            pub fn check_keys(
                &self,
                $scene: $Scene,
            ) -> Result<(), $crate::error::ParameterError> {
                $(
                    $(self.$key.within(stringify!($key), $range, $scene)?;)?
                    $({
                        let check: fn(&Self) -> Result<(), $crate::error::ParameterError> = $check;
                        check(self)?;
                    })?
                )*
                Ok(())
            }
        }
    };
    (
        $(#[$about:meta])*
        $vis:vis struct $Name:ident {
            $($(#[$attribute:meta])* $key:ident: $type:ty = $default:expr;)*
        }
    ) => {
        $(#[$about])*
        #[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields, default)]
        $vis struct $Name {
            $($(#[$attribute])* $vis $key: $type,)*
        }

        impl $Name {
            /// The names of its keys, in their order.
            #[allow(dead_code, reason = "not every table is asked")]
            $vis const NAMES: &[&str] = &[$(stringify!($key)),*];
        }

        impl Default for $Name {
            fn default() -> Self {
                Self {
                    $($key: $default,)*
                }
            }
        }
    };
}

/// A member of a family that is read by its [`keys!`]: kind, summary, examples, and its struct, which has the consts `KIND` and
/// `ENTRY`, its registry entry. So has the module, but for the form `declare! { impl … }` of modules with several members.
macro_rules! declare {
    (
        impl $T:ty, $kind:literal: $summary:literal, [$($example:expr),* $(,)?]
        $(#[$about:meta])*
        pub struct $Name:ident $($keys:tt)*
    ) => {
        $crate::registry::keys! {
            $(#[$about])*
            pub struct $Name $($keys)*
        }

        impl $Name {
            /// Its name in configs.
            pub(crate) const KIND: &str = $kind;

            /// The registry entry.
            pub(crate) const ENTRY: $crate::registry::Entry<$T> = $crate::registry::Entry {
                kind: $kind,
                summary: $summary,
                examples: &[$($example),*],
                read: |table| Ok(Box::new($crate::registry::parse::<$Name>(table)?)),
            };
        }

        impl $crate::registry::Resolved for $Name {
            fn resolved(&self) -> $crate::registry::Keys {
                $crate::registry::resolved(Self::KIND, self)
            }
        }
    };
    (
        $T:ty, $kind:literal: $summary:literal, $examples:tt
        $(#[$about:meta])*
        pub struct $Name:ident $($keys:tt)*
    ) => {
        $crate::registry::declare! {
            impl $T, $kind: $summary, $examples
            $(#[$about])*
            pub struct $Name $($keys)*
        }

        pub(crate) const KIND: &str = $Name::KIND;
        pub(super) const ENTRY: $crate::registry::Entry<$T> = $Name::ENTRY;
    };
}

/// Refuses what is left of a table of which the only key was taken out before; the message about another one lists it.
macro_rules! only {
    ($table:expr, $key:literal) => {{
        #[derive(serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Only {
            #[serde(rename = $key)]
            _key: Option<serde::de::IgnoredAny>,
        }
        $crate::registry::parse::<Only>($table).map(drop)
    }};
}

/// Methods of a wrapper that return what those of one of its fields do: `forwarded!(of: remarks -> Vec<String>)`, with their
/// arguments `forwarded!(of: check(axes: &[Axis]) -> bool)`.
macro_rules! forwarded {
    ($field:tt: $($method:ident $(($($argument:ident: $T:ty),*))? -> $Value:ty),* $(,)?) => {
        $(fn $method(&self $($(, $argument: $T)*)?) -> $Value {
            self.$field.$method($($($argument),*)?)
        })*
    };
}

pub(crate) use {declare, family, forwarded, keys, only};
