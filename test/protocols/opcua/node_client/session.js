// SPDX-License-Identifier: Apache-2.0
// A session of node-opcua that a test drives: one JSON request per line of its input, one JSON answer per line.
// Arguments: address, folder for its keys, and user and password, or neither.
const path = require("path");
const readline = require("readline");
const opcua = require("node-opcua-client");
const { OPCUACertificateManager } = require("node-opcua-certificate-manager");

const FIELDS = ["EventId", "EventType", "SourceName", "Message", "Severity", "Time", "ConditionName", "Retain"];
const STATES = ["ActiveState", "AckedState", "ConfirmedState"];

function plain(value) {
  if (value === null || value === undefined) return null;
  if (value instanceof opcua.NodeId) return value.toString();
  if (Buffer.isBuffer(value)) return value.toString("hex");
  if (value instanceof Date) return value.toISOString();
  if (ArrayBuffer.isView(value) || Array.isArray(value)) return Array.from(value, plain);
  if (typeof value === "object" && "text" in value && "locale" in value) return value.text;
  if (typeof value === "object") {
    return Object.fromEntries(Object.entries(value.toJSON ? value.toJSON() : value).map(([key, each]) => [key, plain(each)]));
  }
  return value;
}

// An element of a where clause: {operator, operands}. Operands: {type: node ID}, {field: path}, {number}, {element}.
function clause(elements) {
  const operand = (each) => {
    if ("type" in each) return new opcua.LiteralOperand({ value: { dataType: "NodeId", value: opcua.resolveNodeId(each.type) } });
    if ("number" in each) return new opcua.LiteralOperand({ value: { dataType: "Int32", value: each.number } });
    if ("element" in each) return new opcua.ElementOperand({ index: each.element });
    return new opcua.SimpleAttributeOperand({
      typeDefinitionId: "i=2041",
      browsePath: each.field.split("/").map((name) => ({ name })),
      attributeId: opcua.AttributeIds.Value,
    });
  };
  return new opcua.ContentFilter({
    elements: elements.map(({ operator, operands }) => ({
      filterOperator: opcua.FilterOperator[operator],
      filterOperands: operands.map(operand),
    })),
  });
}

function transact(session, request) {
  return new Promise((resolve, reject) =>
    session.performMessageTransaction(request, (error, response) => (error ? reject(error) : resolve(response)))
  );
}

function services(session, subscription) {
  const events = {};
  return {
    read: async ({ node, attribute }) => {
      const value = await session.read({ nodeId: node, attributeId: opcua.AttributeIds[attribute || "Value"] });
      return {
        value: plain(value.value.value),
        type: opcua.DataType[value.value.dataType],
        dimensions: plain(value.value.dimensions),
        status: value.statusCode.name,
        stamp: plain(value.sourceTimestamp),
      };
    },
    browse: async ({ node }) => {
      const result = await session.browse(node);
      return result.references.map((each) => ({
        name: each.browseName.name,
        shown: each.displayName.text,
        node: each.nodeId.toString(),
        reference: each.referenceTypeId.toString(),
        type: each.typeDefinition.toString(),
      }));
    },
    write: async ({ node, type, value }) => {
      const written = { value: { dataType: opcua.DataType[type], value } };
      return (await session.write({ nodeId: node, attributeId: opcua.AttributeIds.Value, value: written })).name;
    },
    call: async ({ object, method, inputs }) => {
      const inputArguments = (inputs || []).map(([type, value]) => ({
        dataType: opcua.DataType[type],
        value: type === "ByteString" ? Buffer.from(value, "hex") : value,
      }));
      return (await session.call({ objectId: object, methodId: method, inputArguments })).statusCode.name;
    },
    // The status codes of writes and calls, each with its reason.
    refusals: async ({ writes, calls }) => {
      const requestHeader = { returnDiagnostics: 0x80 };
      const nodesToWrite = writes.map(([node, type, value]) => ({
        nodeId: node,
        attributeId: opcua.AttributeIds.Value,
        value: { value: { dataType: opcua.DataType[type], value } },
      }));
      const methodsToCall = calls.map(([objectId, methodId]) => ({ objectId, methodId, inputArguments: [] }));
      const nothing = { results: [] };
      const written = writes.length
        ? await transact(session, new opcua.WriteRequest({ requestHeader, nodesToWrite }))
        : nothing;
      const called = calls.length ? await transact(session, new opcua.CallRequest({ requestHeader, methodsToCall })) : nothing;
      const reason = (response, place) => response.diagnosticInfos?.[place]?.additionalInfo || "";
      return [
        ...written.results.map((code, place) => [code.name, reason(written, place)]),
        ...called.results.map((result, place) => [result.statusCode.name, reason(called, place)]),
      ];
    },
    subscribe: async ({ name, where }) => {
      const filter = opcua.constructEventFilter(
        [...FIELDS, ...STATES, ...STATES.map((state) => `${state}.Id`)],
        where ? clause(where) : undefined
      );
      const item = opcua.ClientMonitoredItem.create(
        subscription,
        { nodeId: "i=2253", attributeId: opcua.AttributeIds.EventNotifier },
        { samplingInterval: 0, queueSize: 1000, discardOldest: true, filter },
        opcua.TimestampsToReturn.Both
      );
      events[name] = [];
      item.on("changed", (fields) => {
        const names = [...FIELDS, ...STATES, ...STATES.map((state) => `${state}/Id`)];
        events[name].push(Object.fromEntries(names.map((field, place) => [field, plain(fields[place].value)])));
      });
      return new Promise((resolve) => {
        item.on("initialized", () => resolve(item.statusCode.name));
        item.on("err", (message) => resolve(message));
      });
    },
    events: async ({ name }) => events[name].splice(0),
  };
}

async function main([address, folder, userName, password]) {
  const client = opcua.OPCUAClient.create({
    endpointMustExist: false,
    securityMode: userName ? opcua.MessageSecurityMode.SignAndEncrypt : opcua.MessageSecurityMode.None,
    securityPolicy: userName ? opcua.SecurityPolicy.Basic256Sha256 : opcua.SecurityPolicy.None,
    clientCertificateManager: new OPCUACertificateManager({
      rootFolder: path.join(folder, "pki"),
      automaticallyAcceptUnknownCertificate: true,
    }),
    connectionStrategy: { maxRetry: 1 },
  });
  await client.connect(address);
  const identity = userName ? { type: opcua.UserTokenType.UserName, userName, password } : undefined;
  const session = await client.createSession(identity);
  const subscription = await session.createSubscription2({
    requestedPublishingInterval: 20,
    requestedMaxKeepAliveCount: 10,
    publishingEnabled: true,
  });
  const service = services(session, subscription);
  for await (const line of readline.createInterface({ input: process.stdin })) {
    const request = JSON.parse(line);
    const answer = await service[request.do](request).catch((error) => ({ error: error.message }));
    console.log(JSON.stringify({ answer }));
  }
  await session.close();
  await client.disconnect();
}

main(process.argv.slice(2)).catch((error) => {
  console.error(error.message);
  process.exit(1);
});
