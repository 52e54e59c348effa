//! Choices without keys.

/// An enum of choices, each with its name in files and tables, and a line that describes it, in its docs too, if all have one:
/// `Choice = "name"`, or `Choice = "name": "summary"`. It has `ALL` of them in their order, and the `name` and `summary` of each.
macro_rules! named {
    (
        $(#[$about:meta])*
        $visibility:vis enum $Name:ident {
            $($(#[$of_choice:meta])* $Choice:ident = $name:literal,)+
        }
    ) => {
        $(#[$about])*
        $visibility enum $Name {
            $($(#[$of_choice])* $Choice,)+
        }

        impl $Name {
            /// All of them, in their order.
            #[allow(dead_code, reason = "not every choice is listed")]
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$Choice),+];

            /// Its name.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$Choice => $name,)+
                }
            }
        }
    };
    (
        $(#[$about:meta])*
        $visibility:vis enum $Name:ident {
            $($(#[$of_choice:meta])* $Choice:ident = $name:literal: $summary:literal,)+
        }
    ) => {
        $crate::registry::named! {
            $(#[$about])*
            $visibility enum $Name {
                $($(#[$of_choice])* #[doc = $summary] $Choice = $name,)+
            }
        }

        impl $Name {
            /// One-line description.
            pub fn summary(self) -> &'static str {
                match self {
                    $(Self::$Choice => $summary,)+
                }
            }
        }
    };
}

pub(crate) use named;
