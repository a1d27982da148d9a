"""Which servers get the user's token. A scene's file names its server, and anybody may have made the
file. So the token goes only to servers that the preferences or the environment name."""

import os

from . import preferences

_DEFAULT_SERVER = "127.0.0.1:50051"


def servers_of(place):
    """The servers of an origin's place, HOST:PORT[,..]. No place means those of the environment."""
    text = place if place.strip() else os.environ.get("LIQUIDBLEND_SERVER", "")
    return ",".join(address.strip() for address in (text.strip() or _DEFAULT_SERVER).split(","))


def _key(address):
    # Other letters stay: some become ASCII as small ones, and would pass for another host's.
    return address.strip().lower() if address.isascii() else address


def strangers_in(servers):
    """Those of the servers that neither the preferences nor the environment name."""
    texts = (preferences.get("token_servers"), os.environ.get("LIQUIDBLEND_SERVER", ""))
    known = {_key(address) for text in texts for address in text.split(",") if address.strip()}
    return [address for address in servers.split(",") if _key(address) not in known]


def token_for(servers):
    """The token that the servers get, or "". All of them get it or none does, as each may be asked
    instead of another."""
    return "" if strangers_in(servers) else preferences.token()


def why_kept_back(servers):
    """Why servers do not get the token that there is, and what to do; "" if they do."""
    strangers = strangers_in(servers)
    if not strangers or not preferences.token():
        return ""
    return (f"the token is not sent to {', '.join(strangers)}, which the preferences do not name "
            "under \"Servers of the token\"")
