"""Skills of touch missions, one file each, named as in a mission; they name no backend."""
