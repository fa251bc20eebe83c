// Formats in which a plan is taken away, as the interface names them.

/** `flight` formats need degrees, and a route that breaks nothing unless they are `broken` ones, too; every row is `?format=` of the result. */
export const FORMATS = [
  { name: 'qgc', title: 'QGroundControl plan', file: 'plan', flight: true, main: true },
  { name: 'wpl', title: 'Waypoints (WPL 110)', file: 'waypoints', flight: true },
  { name: 'kml', title: 'KML', file: 'kml', flight: true },
  { name: 'geojson', title: 'GeoJSON', file: 'geojson', flight: true, broken: true },
  { name: 'gpx', title: 'GPX', file: 'gpx', flight: true },
  { name: 'czml', title: 'CZML', file: 'czml', flight: true },
  { name: 'csv', title: 'CSV', file: 'csv' },
  { name: 'json', title: 'Result, JSON', file: 'json', main: true },
  { name: 'svg', title: 'Drawing, SVG', file: 'svg' },
];
