//! The declaration of a model whose keys are numbers.

/// A model as a config names it: what [`declare!`](crate::registry::declare) needs, then the keys in its label, the
/// coordinates that it favours, the BRDF of its keys, and further methods of [`BrdfSpec`](super::BrdfSpec).
macro_rules! formula {
    (
        $kind:literal: $summary:literal, $examples:tt
        $(#[$about:meta])*
        pub struct $Name:ident { $($keys:tt)* }
        label: [$($label:ident),*],
        favours: $favours:ident,
        build: $build:expr,
        $($methods:item)*
    ) => {
        $crate::registry::declare! {
            dyn $crate::brdf::BrdfSpec, $kind: $summary, $examples
            $(#[$about])*
            pub struct $Name(channels: &$crate::brdf::Channels) { $($keys)* }
        }

        impl $crate::brdf::BrdfSpec for $Name {
            fn resolved(&self) -> $crate::registry::Keys {
                $crate::registry::resolved(KIND, self)
            }

            fn label(&self) -> String {
                [KIND.to_owned(), $(self.$label.to_string()),*].join("-")
            }

            fn check(
                &self,
                channels: &$crate::brdf::Channels,
            ) -> Result<(), $crate::brdf::BuildError> {
                Ok(self.check_keys(channels)?)
            }

            fn favours(&self) -> $crate::brdf::Favours {
                $crate::brdf::Favours::$favours
            }

            fn build(
                &self,
                channels: $crate::brdf::Channels,
            ) -> Result<Box<dyn $crate::brdf::Brdf>, $crate::brdf::BuildError> {
                self.check(&channels)?;
                let build: fn(&Self, $crate::brdf::Channels) -> _ = $build;
                Ok(Box::new(build(self, channels)))
            }

            $($methods)*
        }
    };
}

pub(super) use formula;
