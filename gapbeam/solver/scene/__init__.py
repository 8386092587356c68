"""The core: linear structures, contacts, loads and feedback in a scene, marched in time; no mesh, no case file."""
