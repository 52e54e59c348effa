mod components;
mod prior;
