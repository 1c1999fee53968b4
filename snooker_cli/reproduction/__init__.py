"""The reproduction of the source report: ``snooker reproduce``. It uses what notebooks can use."""
