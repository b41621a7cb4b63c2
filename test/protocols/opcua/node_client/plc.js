// SPDX-License-Identifier: Apache-2.0
// A soft PLC with the OPC UA server of node-opcua: secured endpoints only, a user, three nodes per request. Prints its
// address; ends with its input. Arguments: folder for its keys, namespace of the variables, user, password.
const path = require("path");
const { OPCUAServer } = require("node-opcua-server");
const { MessageSecurityMode, SecurityPolicy } = require("node-opcua-secure-channel");
const { DataType } = require("node-opcua-variant");
const { OPCUACertificateManager } = require("node-opcua-certificate-manager");

const FIRST = 4294967295; // no tick yet
const TYPES = { bottles: "UInt16", tick: "UInt32", target: "UInt32", speed: "Float", full: "Boolean" };

async function main([folder, namespace, user, password]) {
  const server = new OPCUAServer({
    port: 0,
    hostname: "plc-of-a-plant",
    serverCertificateManager: new OPCUACertificateManager({
      rootFolder: path.join(folder, "pki"),
      automaticallyAcceptUnknownCertificate: true,
    }),
    securityModes: [MessageSecurityMode.Sign, MessageSecurityMode.SignAndEncrypt],
    securityPolicies: [SecurityPolicy.Basic256Sha256, SecurityPolicy.Aes256_Sha256_RsaPss],
    allowAnonymous: false,
    userManager: { isValidUser: (name, given) => name === user && given === password },
    serverCapabilities: { operationLimits: { maxNodesPerRead: 3, maxNodesPerWrite: 3, maxNodesPerBrowse: 2 } },
  });
  await server.initialize();
  const space = server.engine.addressSpace;
  const own = space.registerNamespace(namespace);
  const gvl = own.addObject({ organizedBy: space.rootFolder.objects, browseName: "GVL" });
  const variables = {};
  for (const [name, dataType] of Object.entries(TYPES)) {
    const access = name === "bottles" || name === "tick" ? "CurrentRead | CurrentWrite" : "CurrentRead";
    const more = { accessLevel: access, userAccessLevel: access };
    variables[name] = own.addVariable({ componentOf: gvl, nodeId: `s=GVL.${name}`, browseName: name, dataType, ...more });
  }
  const set = (name, value) => variables[name].setValueFromSource({ dataType: DataType[TYPES[name]], value });
  const get = (name) => variables[name].readValue().value.value;
  for (const [name, value] of Object.entries({ bottles: 0, tick: FIRST, target: 0, speed: 0, full: false })) set(name, value);

  let last = FIRST;
  const scan = () => {
    const tick = get("tick");
    if (tick !== last) {
      last = tick;
      const speed = get("bottles") > 2 ? 0 : 0.5;
      set("speed", speed);
      set("full", speed === 0);
      set("target", tick + 1);
    }
    setTimeout(scan, 0);
  };
  scan();
  await server.start();
  console.log(`opc.tcp://127.0.0.1:${server.endpoints[0].port}`);
  process.stdin.on("end", () => process.exit(0)).resume();
}

main(process.argv.slice(2)).catch((error) => {
  console.error(error.message);
  process.exit(1);
});
