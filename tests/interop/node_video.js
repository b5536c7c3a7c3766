// Reads the video of one drone with npm `ar-drone` and prints what it saw as a line of JSON.
// Arguments: address of the drone, PNG pictures wanted (0: frames of its PaVE parser alone).
const arDrone = require('ar-drone');
const PaVEParser = require('ar-drone/lib/video/PaVEParser');
const [address, wanted] = [process.argv[2], Number(process.argv[3])];
const client = arDrone.createClient({ip: address, timeout: 4000});
const seen = {frames: 0, keys: 0, sizes: [], pngs: []};

function done() {
  console.log(JSON.stringify(seen));
  process.exit(0);
}

const parser = new PaVEParser();
parser.on('data', (frame) => {
  seen.frames += 1;
  seen.keys += frame.frame_type === 1 ? 1 : 0;
  seen.sizes = [frame.display_width, frame.display_height];
  if (wanted === 0 && seen.frames >= 20 && seen.keys >= 1) done();
});
client.getVideoStream().on('data', (data) => parser.write(data));
if (wanted > 0) {
  client.getPngStream().on('data', (png) => {
    seen.pngs.push([png.readUInt32BE(16), png.readUInt32BE(20), png.length]);
    if (seen.pngs.length >= wanted) done();
  });
}
setTimeout(() => { seen.late = true; done(); }, 40000);
