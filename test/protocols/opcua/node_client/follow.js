// SPDX-License-Identifier: Apache-2.0
// Subscribes to the tick of a line and prints each value, until its input ends. Argument: address.
const opcua = require("node-opcua-client");

async function main([address]) {
  const client = opcua.OPCUAClient.create({
    endpointMustExist: false,
    connectionStrategy: { maxRetry: 1000, initialDelay: 50, maxDelay: 200 },
  });
  client.on("connection_reestablished", () => console.log("again"));
  await client.connect(address);
  const session = await client.createSession();
  const subscription = await session.createSubscription2({
    requestedPublishingInterval: 20,
    requestedMaxKeepAliveCount: 10,
    publishingEnabled: true,
  });
  const item = await subscription.monitor(
    { nodeId: "ns=2;s=run/tick", attributeId: opcua.AttributeIds.Value },
    { samplingInterval: 0, queueSize: 100, discardOldest: true },
    opcua.TimestampsToReturn.Both
  );
  item.on("changed", (value) => console.log(Number(value.value.value[1] ?? value.value.value)));
  process.stdin.on("end", () => process.exit(0)).resume();
}

main(process.argv.slice(2)).catch((error) => {
  console.error(error.message);
  process.exit(1);
});
