// Flies a mission with npm `ardrone-autonomy`, which estimates and controls by itself; prints a line of JSON.
// Argument: address of the drone.
const autonomy = require('ardrone-autonomy');
const options = require('ar-drone/lib/constants').options;
const mission = autonomy.createMission({ip: process.argv[2]});
const wanted = ['DEMO', 'VISION_DETECT', 'MAGNETO', 'WIFI'].reduce((mask, name) => mask | (1 << options[name]), 0);
const seen = {options: []};
mission.client().config('general:navdata_demo', true);
mission.client().config('general:navdata_options', wanted);
mission.client().config('video:video_channel', 1);
mission.client().config('detect:detect_type', 12);
mission.client().on('navdata', (data) => { seen.options = Object.keys(data); });
mission.takeoff().zero().altitude(1).forward(1).right(1).hover(500).land();
// Its steps wait for no landing: give it the time.
const done = () => { setTimeout(() => { process.stdout.write(JSON.stringify(seen) + '\n', () => process.exit(0)); }, 4000); };
mission.run((error) => { seen.error = error ? String(error) : null; done(); });
setTimeout(() => { seen.late = true; done(); }, 70000);
