# Sourced from the root of the repository: sets $python to one that has the systems of benches/peers/cloth/requirements.txt, in
# out/peers-venv unless PEERS_PYTHON names another.
python=${PEERS_PYTHON:-out/peers-venv/bin/python}
if ! [ -x "$python" ]; then
  ci/setup python3-venv python3-dev libsuitesparse-dev libbullet-dev pkg-config g++
  python3 -m venv out/peers-venv
  out/peers-venv/bin/pip install --quiet -r benches/peers/cloth/requirements.txt
fi
