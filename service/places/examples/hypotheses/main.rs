//! How many maps fit a travel, how many of them are minimal, and how long it takes to find out:
//! on a floor like that of HSSH 2004, section IV, and with more and more travels on a larger one, at
//! random or driven by the maps.

mod driven;
mod growth;
mod nested_loops;

fn main() {
    nested_loops::print();
    println!();
    growth::print();
    println!();
    driven::print();
}
