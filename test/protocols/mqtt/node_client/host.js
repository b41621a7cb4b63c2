// SPDX-License-Identifier: Apache-2.0
// What a host in JavaScript makes of the line: prints one JSON object. Arguments: address of the broker, group, node.
const mqtt = require("mqtt");
const sparkplug = require("sparkplug-payload").get("spBv1.0");

const [address, group, node] = process.argv.slice(2);
const topic = (kind) => `spBv1.0/${group}/${kind}/${node}${kind.startsWith("D") ? "/line" : ""}`;
const client = mqtt.connect(address);
const births = {};

// Whole numbers of 64 bits are objects.
const plain = (value) => (value !== null && typeof value === "object" && "low" in value ? value.toNumber() : value);

const send = (kind, metrics) => client.publish(topic(kind), Buffer.from(sparkplug.encodePayload({ timestamp: Date.now(), metrics })));

const told = (metric) => ({
  type: metric.type,
  value: plain(metric.value),
  ...Object.fromEntries(Object.entries(metric.properties ?? {}).map(([key, found]) => [key, plain(found.value)])),
});

client.on("connect", () =>
  client.subscribe(`spBv1.0/${group}/#`, () => send("NCMD", [{ name: "Node Control/Rebirth", type: "Boolean", value: true }]))
);
client.on("message", (where, data) => {
  const kind = where.split("/")[2];
  if (kind.endsWith("CMD")) return;
  const payload = sparkplug.decodePayload(data);
  const metrics = Object.fromEntries(payload.metrics.map((metric) => [metric.name, told(metric)]));
  if (kind.endsWith("BIRTH")) births[kind] = { seq: plain(payload.seq), metrics };
  if (kind === "DBIRTH")
    send("DCMD", [
      { name: "belts/zone1/cmd_speed", type: "Double", value: 0.125 },
      { name: "belts/zone1/run", type: "Boolean", value: true },
    ]);
  if (kind === "DDATA" && metrics["belts/zone1/cmd_speed"]) {
    console.log(JSON.stringify({ ...births, changed: metrics["belts/zone1/cmd_speed"] }));
    client.end();
  }
});
