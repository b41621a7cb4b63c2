// SPDX-License-Identifier: Apache-2.0
// What node-opcua makes of the server: prints one JSON object. Arguments: address, user, password, folder for its keys.
const path = require("path");
const opcua = require("node-opcua-client");
const { OPCUACertificateManager } = require("node-opcua-certificate-manager");

const id = (name) => `ns=2;s=${name}`;

async function main([address, userName, password, folder]) {
  const client = opcua.OPCUAClient.create({
    endpointMustExist: false,
    securityMode: opcua.MessageSecurityMode.SignAndEncrypt,
    securityPolicy: opcua.SecurityPolicy.Basic256Sha256,
    clientCertificateManager: new OPCUACertificateManager({
      rootFolder: path.join(folder, "pki"),
      automaticallyAcceptUnknownCertificate: true,
    }),
    connectionStrategy: { maxRetry: 1 },
  });
  await client.connect(address);
  const session = await client.createSession({ type: opcua.UserTokenType.UserName, userName, password });

  const read = async (name) => {
    const value = await session.read({ nodeId: id(name), attributeId: opcua.AttributeIds.Value });
    return { value: value.value.value, type: opcua.DataType[value.value.dataType], status: value.statusCode.name };
  };
  const write = (name, dataType, value) =>
    session.write({ nodeId: id(name), attributeId: opcua.AttributeIds.Value, value: { value: { dataType, value } } });

  const found = await session.browse(id("belts/zone1"));
  const unit = (await read("belts/zone1/cmd_speed/EngineeringUnits")).value;
  const range = (await read("belts/zone1/cmd_speed/EURange")).value;
  const states = (await read("machines/filler/state/EnumStrings")).value;

  const subscription = await session.createSubscription2({ requestedPublishingInterval: 20, publishingEnabled: true });
  const item = await subscription.monitor(
    { nodeId: id("run/tick"), attributeId: opcua.AttributeIds.Value },
    { samplingInterval: 0, queueSize: 100, discardOldest: true },
    opcua.TimestampsToReturn.Both
  );
  const first = await new Promise((resolve) => item.once("changed", (value) => resolve(value)));
  await subscription.terminate();

  const called = await session.call({ objectId: id("line"), methodId: id("line/disown"), inputArguments: [] });
  console.log(
    JSON.stringify({
      namespaces: await session.readNamespaceArray(),
      children: found.references.map((each) => each.browseName.name),
      speed: await read("belts/zone1/cmd_speed"),
      bottles: await read("belts/zone1/bottles"),
      running: await read("belts/zone1/running"),
      unit: [unit.unitId, unit.displayName.text],
      range: [range.low, range.high],
      states: states.map((each) => each.text),
      tick: Number(first.value.value[1] ?? first.value.value),
      stamped: first.sourceTimestamp !== null,
      good: (await write("belts/zone1/cmd_speed", opcua.DataType.Double, 0.125)).name,
      beyond: (await write("belts/zone1/cmd_speed", opcua.DataType.Double, 99)).name,
      wrong: (await write("belts/zone1/cmd_speed", opcua.DataType.String, "1")).name,
      signal: (await write("belts/zone1/speed", opcua.DataType.Double, 0.1)).name,
      called: called.statusCode.name,
      mode: (await write("belts/zone2/mode", opcua.DataType.UInt32, 3)).name,
    })
  );
  await session.close();
  await client.disconnect();
}

main(process.argv.slice(2)).catch((error) => {
  console.error(error.message);
  process.exit(1);
});
