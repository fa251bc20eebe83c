// Loads CZML files with Cesium and prints what it read, as JSON.
import fs from 'node:fs';

// Cesium tests whether a value is one of these before it reads it as a number; here none is.
for (const name of ['Image', 'HTMLImageElement', 'HTMLCanvasElement', 'HTMLVideoElement', 'ImageBitmap', 'OffscreenCanvas']) {
  globalThis[name] ??= class {};
}
const { Cartographic, CzmlDataSource, JulianDate, Math: { toDegrees } } = await import('cesium');

function place(entity, time) {
  const { longitude, latitude, height } = Cartographic.fromCartesian(entity.position.getValue(time));
  return [toDegrees(longitude), toDegrees(latitude), height];
}

async function read(file) {
  const scene = await CzmlDataSource.load(JSON.parse(fs.readFileSync(file, 'utf8')));
  const vehicle = scene.entities.getById('vehicle');
  const { start, stop } = vehicle.availability.get(0);
  const { startTime, stopTime } = scene.clock;
  if (!JulianDate.equals(start, startTime) || !JulianDate.equals(stop, stopTime)) {
    throw new Error('the clock runs at another time than the vehicle');
  }
  const entities = scene.entities.values;
  return {
    first: place(vehicle, start),
    last: place(vehicle, stop),
    seconds: JulianDate.secondsDifference(stop, start),
    radii: entities.filter((entity) => entity.cylinder).map((entity) => entity.cylinder.topRadius.getValue(start)),
    polygons: entities.filter((entity) => entity.polygon).length,
  };
}

const scenes = [];
for (const file of process.argv.slice(2)) scenes.push(await read(file));
console.log(JSON.stringify(scenes));
