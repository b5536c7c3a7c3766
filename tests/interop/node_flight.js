// Flies one drone with npm `ar-drone` and prints what it saw as a line of JSON.
// Arguments: address of the drone, "demo" or "full" navdata, seconds forward.
const arDrone = require('ar-drone');
const [address, mode, seconds] = [process.argv[2], process.argv[3], Number(process.argv[4])];
const client = arDrone.createClient({ip: address, timeout: 300});
const seen = {acks: [], events: [], packets: 0, options: {}, errors: 0, altitude: 0, psi: [], last: null};

for (const event of ['takeoff', 'hovering', 'flying', 'landing', 'landed']) {
  client.on(event, () => seen.events.push(event));
}
client._udpNavdatasStream.on('error', () => { seen.errors += 1; });
client.on('navdata', (data) => {
  seen.packets += 1;
  for (const name of Object.keys(data)) seen.options[name] = (seen.options[name] || 0) + 1;
  if (data.demo) {
    seen.altitude = Math.max(seen.altitude, data.demo.altitudeMeters);
    seen.last = {battery: data.demo.batteryPercentage, state: data.demo.controlState, psi: data.demo.rotation.clockwise};
  }
  if (data.gps) seen.gps = data.gps.hdop;
});

function done() {
  console.log(JSON.stringify(seen));
  process.exit(0);
}

const configured = (name) => (error) => seen.acks.push([name, error === null]);
client.config('general:navdata_demo', mode === 'demo' ? 'TRUE' : 'FALSE', configured('navdata_demo'));
client.config('control:altitude_max', '2500', configured('altitude_max'));
client.config('control:euler_angle_max', '0.2', configured('euler_angle_max'));
setTimeout(() => {
  client.takeoff(() => {
    client.front(0.3);
    setTimeout(() => {
      client.stop();
      setTimeout(() => client.land(() => setTimeout(done, 300)), 4000);
    }, seconds * 1000);
  });
}, 1500);
setTimeout(() => { seen.late = true; done(); }, 60000);
