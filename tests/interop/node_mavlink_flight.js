// Flies a vehicle with npm `node-mavlink`: arm, take off, land; prints a line of JSON. Argument: its address.
const dgram = require('dgram');
const { PassThrough } = require('stream');
const mavlink = require('node-mavlink');
const { minimal, common, MavLinkProtocolV2, MavLinkPacketSplitter, MavLinkPacketParser } = mavlink;
const registry = { ...minimal.REGISTRY, ...common.REGISTRY };
const socket = dgram.createSocket('udp4');
const protocol = new MavLinkProtocolV2(255, 190);
const seen = { acks: {}, height: 0 };
let sequence = 0;
let armed = false;
const send = (message) => socket.send(protocol.serialize(message, sequence++ & 255), 14550, process.argv[2]);
const heartbeat = () => {
  const beat = new minimal.Heartbeat();
  [beat.type, beat.autopilot, beat.baseMode, beat.systemStatus, beat.mavlinkVersion] = [6, 8, 0, 4, 3];
  send(beat);
};
const command = (number, values) => {
  const order = new common.CommandLong();
  [order.command, order.targetSystem, order.targetComponent, order.confirmation] = [number, 1, 1, 0];
  values.forEach((value, index) => { order[`_param${index + 1}`] = value; });
  send(order);
};
const stream = new PassThrough();
stream.pipe(new MavLinkPacketSplitter()).pipe(new MavLinkPacketParser()).on('data', (packet) => {
  const kind = registry[packet.header.msgid];
  if (!kind) return;
  const data = packet.protocol.data(packet.payload, kind);
  if (kind === minimal.Heartbeat) armed = (data.baseMode & 128) !== 0;
  if (kind === common.LocalPositionNed) seen.height = Math.max(seen.height, -data.z);
  if (kind === common.CommandAck) seen.acks[data.command] = data.result;
});
socket.on('message', (bytes) => stream.write(bytes));
const end = () => process.stdout.write(JSON.stringify(seen) + '\n', () => process.exit(0));
const until = (condition, next) => {
  const timer = setInterval(() => { if (condition()) { clearInterval(timer); next(); } }, 100);
};
const NAN = Number.NaN;
setInterval(heartbeat, 500);
setTimeout(() => { seen.late = true; end(); }, 60000);
// It may be armed once its filter has had some seconds of fixes.
setTimeout(() => command(400, [1, 0, 0, 0, 0, 0, 0]), 3000);
until(() => armed, () => {
  command(22, [NAN, NAN, NAN, NAN, NAN, NAN, NAN]);
  until(() => seen.height > 2.3, () => {
    command(21, [0, 0, 0, NAN, 0, 0, 0]);
    until(() => !armed, () => { seen.disarmed = true; end(); });
  });
});
