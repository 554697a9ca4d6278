//! Buildings in which robots of unknown start are found, or cannot be.

use meetpoint_geometry::Pose;
use meetpoint_sim::{Building, Robot};

use crate::drive::SimulatedDrive;

/// Edge of a character of the drawings, in metres.
const CHARACTER_M: f64 = 0.4;

/// Rooms of which none is like another, along a corridor.
const HOUSE: &str = "
    ############################################################
    #####         #             ######       #####             #
    #####         #             ######       #####             #
    #####         #             ######       #####  ###        #
    #             #   ####      ######           #  ###        #
    #         #####   ####           #  ###      #  ###        #
    #         #####   ####           #  ###      #  ###        #
    #             #   ####           #           #  ###   E    #
    #      B      #                  #           #  ###        #
    #             #          C       #     D     #             #
    #             #                  #           #          ####
    #             #                  #           #          ####
    #             #                  #           #          ####
    ######    ############    ###########    #########    ######
    #                                                          #
    #                                                          #
    #    A              L                                      #
    #                             J             K          F   #
    #               ###                                        #
    #               ###                                        #
    #########    ###############    ##############    ##########
    #                   #                  #                   #
    #                   #              #####                   #
    #                   #              #####                   #
    #                   #              #####        G     ######
    #         I   ##    #         H    #####              ######
    #             ##    #              #####                   #
    #             ##    #                  #                   #
    #######       ##    #                  #                   #
    #######             #                  #  #####            #
    #######             #  #######         #  #####            #
    #######             #  #######         #                   #
    #######             #  #######         #                   #
    ############################################################";

/// Two wings that are alike, and a hall.
const TWINS: &str = "
    ################################################################
    #           #            ##############           #            #
    # ###       #            ############## ###       #            #
    # ###       #   #####    ############## ###       #   #####    #
    # ###       #   #####    ############## ###       #   #####    #
    #         M #            ##############         N #            #
    #                        ##############                        #
    #     A            B     ##############     E            F     #
    #                        ##############                        #
    #       ###           #################       ###           ####
    #       ### #  ##     #################       ### #  ##     ####
    #       ### #  ##     #################       ### #  ##     ####
    #           #  ##     #################           #  ##     ####
    #           #         #################           #         ####
    #####    ##################################    #################
    #####    ##################################    #################
    #                                                              #
    #                                                              #
    #     C                                     D                  #
    #                              G                               #
    #                                                              #
    #                                                              #
    #                                                              #
    ################################################################";

/// The way of the first robot through the house, along the corridor and into three rooms: some 30 m.
pub(crate) const FIRST_WAY: &str = "ABLCJHJK";
/// That of another one, which begins where the first has not been: some 30 m.
pub(crate) const SECOND_WAY: &str = "GKJHJCL";
/// The first robot's through both wings.
pub(crate) const BOTH_WINGS: &str = "MBAGENFE";
/// Another one's, through the wing on the right, out of which it does not look.
pub(crate) const ONE_WING: &str = "FENEF";

/// A drive through the house by way of these places.
pub(crate) fn through_the_house(way: &str, seed: u64) -> SimulatedDrive {
    through(HOUSE, way, seed)
}

/// A drive through the twins by way of these places.
pub(crate) fn through_the_twins(way: &str, seed: u64) -> SimulatedDrive {
    through(TWINS, way, seed)
}

/// Where the twins' places are, in the building's frame, in metres.
pub(crate) fn places_of_the_twins(names: &str) -> Vec<[f64; 2]> {
    let places = building(TWINS).places(names).expect("places that are drawn");
    places.iter().map(|at| [at.x, at.y]).collect()
}

/// A scan every fifth of a second.
fn through(drawing: &str, way: &str, seed: u64) -> SimulatedDrive {
    let building = building(drawing);
    let robot = Robot { n_ticks_per_scan: 4, ..Robot::INDOOR };
    let places = building.places(way).expect("places that are drawn");
    SimulatedDrive::by_way_of(&building, robot, &places, seed)
}

fn building(drawing: &str) -> Building {
    let building = Building::from_drawing(drawing.trim_start_matches('\n'), CHARACTER_M);
    building.expect("a good drawing")
}

/// Where a drive truly begins in the frame of another one's start.
pub(crate) fn true_place(first: &SimulatedDrive, second: &SimulatedDrive) -> Pose {
    first.building_from_start.inverse() * second.building_from_start
}
