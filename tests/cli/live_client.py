"""Acts as the browser in tests of `covol mark`: the cookie, requests and the WebSocket (RFC 6455)."""
import base64
import http.client
import json
import os
import socket
import struct
import zlib


class Page:
    """The requests of a page that was loaded from `url`."""

    def __init__(self, url):
        self.origin, self.token = url.split("/?token=")
        self.authority = self.origin.removeprefix("http://")
        host, port = self.authority.split(":")
        self.address = (host, int(port))
        status, headers, _ = self.get("/?token=" + self.token, cookie=False)
        assert status == 303, status
        self.cookie = headers["Set-Cookie"].split(";")[0]

    def get(self, path, cookie=True, **headers):
        """Status, headers and body, decompressed."""
        connection = http.client.HTTPConnection(*self.address, timeout=60)
        given = {"Cookie": self.cookie} if cookie else {}
        connection.request("GET", path, headers=given | {name.replace("_", "-"): value for name, value in headers.items()})
        answer = connection.getresponse()
        body = answer.read()
        if answer.headers.get("Content-Encoding") == "deflate":
            body = zlib.decompress(body)
        connection.close()
        return answer.status, answer.headers, body

    def post(self, path, body, **headers):
        """Status and text; `headers` replace those of a page."""
        connection = http.client.HTTPConnection(*self.address, timeout=60)
        given = {"Cookie": self.cookie, "Origin": self.origin, "Content-Length": str(len(body))} | headers
        connection.putrequest("POST", path)
        for name, value in given.items():
            if value is not None:
                connection.putheader(name, value)
        connection.endheaders()
        try:
            connection.send(body)
        except OSError:
            pass  # the server has refused the request before it read the whole body
        answer = connection.getresponse()
        text = answer.read().decode()
        connection.close()
        return answer.status, text

    def json(self, path):
        status, _, body = self.get(path)
        assert status == 200, (status, body)
        return json.loads(body)


class Live:
    """The WebSocket; messages are JSON."""

    def __init__(self, page, origin=None, cookie=None):
        self.socket = socket.create_connection(page.address, timeout=60)
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall((
            f"GET /live HTTP/1.1\r\nHost: {page.authority}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Origin: {origin or page.origin}\r\nCookie: {cookie or page.cookie}\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n").encode())
        self.buffer = b""
        while b"\r\n\r\n" not in self.buffer:
            self._more()
        head, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
        self.status = int(head.split()[1])
        self.count = 0
        self.results = []  # all results, in the order of their messages
        if self.status == 101:
            self.state = self.receive()["state"]
            self.results += [s["result"] for s in self.state["structures"] if s["result"]]

    def _more(self):
        data = self.socket.recv(1 << 16)
        if not data:
            raise ConnectionError("the server closed the connection")
        self.buffer += data

    def _take(self, count):
        while len(self.buffer) < count:
            self._more()
        taken, self.buffer = self.buffer[:count], self.buffer[count:]
        return taken

    def _send(self, opcode, payload):
        size, mask = len(payload), os.urandom(4)
        head = bytes([0x80 | opcode])
        head += bytes([0x80 | size]) if size < 126 else bytes([0x80 | 126]) + struct.pack(">H", size) if size < 65536 else \
            bytes([0x80 | 127]) + struct.pack(">Q", size)
        self.socket.sendall(head + mask + bytes(b ^ mask[n % 4] for n, b in enumerate(payload)))

    def send_text(self, text):
        self._send(1, text.encode())

    def receive(self):
        """The next message; pings are answered."""
        while True:
            head = self._take(2)
            opcode, size = head[0] & 15, head[1] & 127
            if size == 126:
                size = struct.unpack(">H", self._take(2))[0]
            elif size == 127:
                size = struct.unpack(">Q", self._take(8))[0]
            payload = self._take(size)
            if opcode == 9:
                self._send(10, payload)
            elif opcode == 8:
                raise ConnectionError(f"the server closed the connection: {payload[:2].hex()}")
            elif opcode == 1:
                message = json.loads(payload)
                if "result" in message:
                    self.results.append(message["result"])
                return message

    def act(self, **action):
        """Sends an action and waits until it is on disk. @return the patches that came meanwhile, and the last message"""
        self.count += 1
        key = action.setdefault("key", f"test-{id(self)}-{self.count}")
        self.send_text(json.dumps(action))
        patches = []
        while True:
            message = self.receive()
            if "patch" in message:
                patches.append(message["patch"])
            if message.get("done") == key or message.get("failed") == key:
                return patches, message

    def add_structure(self, name):
        patches, done = self.act(do="add_structure", name=name)
        assert "done" in done, done
        return patches[-1]["structures"][0]["id"]

    def add_mark(self, structure, world, kind="surface"):
        patches, done = self.act(do="add_mark", structure=structure, kind=kind, world=list(world))
        assert "done" in done, done
        return patches[-1]["structures"][0]["marks"][-1]["id"]

    def wait_for(self, structure, stage, sequence=0):
        """The last result of that stage if it was computed for that state or a later one, else the next such result."""
        for result in reversed(self.results):
            if (result["structure"], result["stage"]) == (structure, stage) and result["seq"] >= max(sequence, 1):
                return result
        while True:
            message = self.receive()
            result = message.get("result")
            if result and (result["structure"], result["stage"]) == (structure, stage) and result["seq"] >= sequence:
                return result

    def close(self):
        self.socket.close()
