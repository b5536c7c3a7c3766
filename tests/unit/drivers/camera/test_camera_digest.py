"""Digest authentication: the standards' examples, and challenges that cannot be answered."""

import re

import pytest

from drivers.camera.digest import authorization, challenge_of

OLD = (
    b"HTTP/1.1 401 Unauthorized\r\n"
    b'WWW-Authenticate: Digest realm="testrealm@host.com", qop="auth,auth-int", '
    b'nonce="dcd98b7102dd2f0e8b11d0f600bfb0c093", opaque="5ccc069c403ebaf9f0171e9517f40e41"\r\n'
)
NEW = (
    b'HTTP/1.1 401 Unauthorized\nwww-authenticate: Basic realm="x"\n'
    b'WWW-Authenticate: Digest realm="http-auth@example.org", qop=auth, algorithm=%s, '
    b'nonce="7ypf/xlj9XXwfDPEoM4URrv/xwf94BcCAzFZH4GiTo0v", opaque="FQhe/qaU925kfnzjCev0ciny7QMkPqMAFRtzCUYo5tdS"\n'
)
CLIENT_NONCE = "f2/wE4q74E6zIJEtWaHKaf5wv/H5QzzpXusqGemxURZJ"


def response(text: str) -> str:
    (found,) = re.findall(r'response="([0-9a-f]+)"', text)
    return str(found)


@pytest.mark.parametrize(
    ("head", "password", "client_nonce", "wanted"),
    [
        # RFC 2617, 3.5; RFC 7616, 3.9.1.
        (OLD, "Circle Of Life", "0a4f113b", "6629fae49393a05397450978507c4ef1"),
        (NEW % b"MD5", "Circle of Life", CLIENT_NONCE, "8ca523f5e9506fed4657c9700eebdbec"),
        (
            NEW % b"SHA-256",
            "Circle of Life",
            CLIENT_NONCE,
            "753927fa0e85d155564e2e272a28d1802ca10daf4496794697cf8db5856cb6c1",
        ),
    ],
)
def test_the_examples_of_the_standards(head: bytes, password: str, client_nonce: str, wanted: str) -> None:
    challenge = challenge_of(head)
    assert challenge is not None
    said = authorization(challenge, f"Mufasa:{password}", "/dir/index.html", client_nonce)
    assert response(said) == wanted
    assert said.startswith('Digest username="Mufasa", realm="') and "qop=auth, nc=00000001" in said
    assert f'opaque="{challenge.opaque}"' in said and password not in said


def test_an_old_camera_without_qop_gets_no_count() -> None:
    """The example of RFC 2069, as its errata correct it."""
    challenge = challenge_of(OLD.replace(b'qop="auth,auth-int", ', b""))
    assert challenge is not None and not challenge.qop
    said = authorization(challenge, "Mufasa:CircleOfLife", "/dir/index.html", "never used")
    assert response(said) == "1949323746fe6a43ef61f9606e7febea"
    assert "nc=" not in said and "cnonce" not in said


@pytest.mark.parametrize(
    "head",
    [
        b"HTTP/1.1 401 Unauthorized",
        b'WWW-Authenticate: Basic realm="a digest, nonce=1"',
        b'WWW-Authenticate: Digest realm="cam"',
        b'WWW-Authenticate: Digest realm="cam", nonce="1", qop="auth-int"',
        b'WWW-Authenticate: Digest realm="cam", nonce="1", algorithm=SHA-512-256',
    ],
)
def test_challenges_that_cannot_be_answered_are_ignored(head: bytes) -> None:
    assert challenge_of(head) is None


def test_the_first_challenge_that_can_be_answered_counts() -> None:
    lines = [b'WWW-Authenticate: Digest nonce="1", algorithm=X', b'WWW-Authenticate: Digest nonce="2", algorithm=md5']
    found = challenge_of(b"\r\n".join(lines))
    assert found is not None and (found.nonce, found.algorithm) == ("2", "MD5")
