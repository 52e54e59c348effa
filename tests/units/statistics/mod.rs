mod bootstrap;
mod mean;
mod order;
mod paired;
mod variance;
mod wilcoxon;
