//! `QGC WPL 110`: a mission as lines of text, which nearly every ground station reads. It has no fences.

use std::fmt::Write as _;

use super::items::{FRAME_GLOBAL, Item, NAV_WAYPOINT, mission};
use crate::export::{Altitude, Delivery, ExportError, Firmware, OptionFault, Options};

/// Whether the firmware knows the frame of the altitudes.
pub(in crate::export) fn fits(options: &Options) -> Result<(), OptionFault> {
    if options.altitude == Altitude::Terrain && options.firmware == Firmware::Px4 {
        return Err(OptionFault {
            name: "altitude".to_owned(),
            detail: "altitude is \"terrain\", must be relative or absolute for px4, which knows no other frame"
                .to_owned(),
        });
    }
    Ok(())
}

/// Write the mission of a plan.
pub(in crate::export) fn write(
    delivery: &Delivery,
    options: &Options,
) -> Result<String, ExportError> {
    let mission = mission(delivery, options)?;
    let home = Item {
        command: NAV_WAYPOINT,
        frame: FRAME_GLOBAL,
        params: [Some(0.0); 4],
        place: Some(mission.home),
    };
    // ArduPilot has home as the first item, PX4 does not.
    let home = (options.firmware == Firmware::ArduPilot).then_some(home);
    let mut text = "QGC WPL 110\n".to_owned();
    for (index, item) in home.iter().chain(&mission.items).enumerate() {
        line(&mut text, index, item, left(options.firmware));
    }
    Ok(text)
}

/// The value that leaves a parameter to the autopilot: a yaw of 0 makes PX4 face north, and is ignored by ArduPilot.
fn left(firmware: Firmware) -> &'static str {
    match firmware {
        // In the letter case that QGroundControl reads and writes.
        Firmware::Px4 => "nan",
        Firmware::ArduPilot => "0",
    }
}

fn line(text: &mut String, index: usize, item: &Item, left: &str) {
    let Item { command, frame, .. } = item;
    let current = u8::from(index == 0);
    let _ = write!(text, "{index}\t{current}\t{frame}\t{command}");
    for param in item.params {
        let _ = match param {
            Some(value) => write!(text, "\t{value}"),
            None => write!(text, "\t{left}"),
        };
    }
    let place = item
        .place
        .map(|place| (place.lat, place.lon, place.altitude_m));
    let (lat, lon, altitude_m) = place.unwrap_or_default();
    let _ = writeln!(text, "\t{lat:.7}\t{lon:.7}\t{altitude_m:.3}\t1");
}
